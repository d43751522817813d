// SPDX-License-Identifier: Apache-2.0
#pragma once
// What clients of the daemon's HTTP send: sound requests to every route there is, and some in the
// order in which a client would send them.

#include <map>
#include <string>
#include <vector>

#include "cli/service/city_routes.h"
#include "cli/service/openapi.h"
#include "cli/service/tus_message.h"
#include "storage/base/content_hash.h"
#include "tests/engine/camera/photo_writer.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

// `headers`: further ones, each with its line's end. An empty token is not sent.
inline std::string RequestOf(const std::string& method, const std::string& target,
                             const std::string& token, const std::string& headers = "",
                             const std::string& body = "") {
  std::string text = method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers;
  if (!token.empty()) text += "Authorization: Bearer " + token + "\r\n";
  if (!body.empty()) text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  return text + "\r\n" + body;
}

// A small picture with just so many corners that a city keeps it: two that are alike are soon
// compared.
inline std::string SeedPhoto(uint64_t seed) {
  SeededRandom random(seed);
  cv::Mat bgr(88, 128, CV_8UC3);
  for (int v = 0; v < bgr.rows; v += 8) {
    for (int u = 0; u < bgr.cols; u += 8) {
      const auto gray = static_cast<double>(random.Below(256));
      bgr(cv::Rect(u, v, 8, 8)) = cv::Scalar(gray, gray, gray);
    }
  }
  return Text(testing::JpegFile(bgr));
}

// The body of a request to a route that wants one.
inline std::string SeedBody(const std::string& path) {
  static const std::map<std::string, std::string> kBodies = {
      {"/v1/cameras", R"({"name": "street", "size": "128x88", "params": "120,120,64,44"})"},
      {"/v1/contributions", R"({"comment": "a walk", "licence": "CC0-1.0"})"},
      {"/v1/photos/{photo}/report", R"({"reason": "privacy", "text": "a face"})"},
      {"/v1/reports/{report}/dismiss", R"({"actor": "anna"})"},
      {"/v1/hidden", R"({"photos": ["#1"], "reason": "asked"})"},
      {"/v1/shown", R"({"photos": ["#1"], "actor": "anna"})"},
      {"/v1/removals", R"({"photos": ["#1"], "actor": "anna", "why": "asked"})"},
      {"/v1/forbidden", R"({"kind": "pair", "a": "#1", "b": "#2", "actor": "anna"})"},
      {"/v1/allowed", R"({"kind": "pose", "a": "#1", "reason": "right after all"})"},
      {"/v1/tokens", R"({"name": "ben", "role": "viewer", "expires": 4000000000,
                         "photos_per_day": 3, "requests_per_second": 4, "bytes_per_day": 5})"},
      {"/v1/links", R"({"name": "a friend", "days": 3, "contribution": 1})"},
      {"/v1/stac/search", R"({"bbox": [11, 48, 12, 49], "limit": 2, "ids": ["1"],
                              "datetime": "2026-01-01T00:00:00Z/..",
                              "collections": ["photos"]})"},
      {"/v1/georeference",
       "EPSG:4326\n11.57 48.13 520 12.5 13.5 a.jpg\n11.58 48.14 521 14.5 15.5 a.jpg\n"}};
  const auto found = kBodies.find(path);
  return found == kBodies.end() ? "{}" : found->second;
}

inline std::string SeedQuery(const CityRoute& route) {
  static const std::map<std::string, std::string> kValues = {
      {"from", "1"},
      {"count", "2"},
      {"name", "a.jpg"},
      {"camera", "street"},
      {"side", "64"},
      {"form", "ypr"},
      {"contributor", "anna"},
      {"near", "a.jpg"},
      {"place", "48,11"},
      {"deviation", "0.5"},
      {"actor", "anna"},
      {"file", "gcp.txt"},
      {"state", "all"},
      {"limit", "3"},
      {"bbox", "11,48,12,49"},
      {"token", "1"},
      {"ids", "1,2"},
      {"collections", "photos"},
      {"datetime", "../2026-12-31T00:00:00Z"}};
  std::string query;
  for (const std::string& name : route.parameters) {
    const auto value = kValues.find(name);
    if (value != kValues.end()) query += (query.empty() ? "?" : "&") + name + "=" + value->second;
  }
  return query;
}

// One sound request to the route, but for what is not there in an empty city.
inline std::string SeedRequest(const CityRoute& route, const std::string& token) {
  const std::string path = PathTemplate(route);
  std::string target, before;
  for (const std::string& part : route.path) {
    const std::string one = before == "photos"        ? "%231"
                            : before == "collections" ? "photos"
                            : before == "cameras"     ? "street"
                            : before == "tiles"       ? "0.glb"
                            : before == "tokens"      ? "5"  // that an earlier seed has made
                            : before == "tus"         ? "0123456789abcdef0123456789abcdef"
                                                      : "1";
    target += "/" + (part == "*" ? one : part);
    before = part;
  }
  if (target.empty()) target = "/";
  target += SeedQuery(route);
  const std::string method = route.method;
  if (path.starts_with("/v1/tus")) {
    std::string headers = std::string("Tus-Resumable: ") + kTusVersion + "\r\n";
    if (method == "POST") headers += "Upload-Length: 9\r\nUpload-Metadata: filename YS5qcGc=\r\n";
    if (method == "PATCH")
      headers += std::string("Upload-Offset: 0\r\nContent-Type: ") + kTusContentType + "\r\n";
    return RequestOf(method, target, token, headers, method == "PATCH" ? "part" : "");
  }
  if (method != "POST") return RequestOf(method, target, token);
  if (path == "/v1/photos" || path == "/v1/candidates" || path == "/v1/localize") {
    return RequestOf(method, target, token, "Content-Type: image/jpeg\r\nPrefer: respond-async\r\n",
                     SeedPhoto(1));
  }
  const std::string type = path == "/v1/georeference" ? "text/plain" : "application/json";
  return RequestOf(method, target, token, "Content-Type: " + type + "\r\n", SeedBody(path));
}

// What somebody does who adds photos and looks at them.
inline std::string SeedVisit(const std::string& token) {
  const std::string json = "Content-Type: application/json\r\n",
                    jpeg = "Content-Type: image/jpeg\r\n";
  std::string visit = RequestOf("POST", "/v1/cameras", token, json, SeedBody("/v1/cameras"));
  for (const char* const name : {"a", "b"}) {
    visit += RequestOf("POST", std::string("/v1/photos?camera=street&name=") + name + ".jpg", token,
                       jpeg, SeedPhoto(name[0]));
  }
  for (const char* const part : {"", "/pose", "/geopose?form=quaternion", "/uncertainty",
                                 "/thumbnail?side=32", "/neighbors"})
    visit += RequestOf("GET", std::string("/v1/photos/%231") + part, token);
  visit +=
      RequestOf("GET", "/v1/photos/a.jpg/file", token, "Range: bytes=2-5\r\nIf-Range: \"x\"\r\n");
  visit += RequestOf("HEAD", "/v1/photos/a.jpg/file", token, "Range: bytes=-5\r\n");
  visit += RequestOf("GET", "/v1/photos", token, "If-None-Match: W/\"1-2\"\r\n");
  visit += RequestOf("GET", "/page.css", token, "Range: bytes=9-\r\nAccept: text/css\r\n");
  visit += RequestOf("POST", "/v1/photos/%231/report", token, json,
                     SeedBody("/v1/photos/{photo}/report"));
  for (const char* const path :
       {"/v1/hidden", "/v1/shown", "/v1/forbidden", "/v1/georeference", "/v1/removals"}) {
    const bool is_text = std::string(path) == "/v1/georeference";
    visit += RequestOf("POST", path, token, is_text ? "Content-Type: text/plain\r\n" : json,
                       SeedBody(path));
  }
  return visit;
}

// A photo that comes in parts, is asked for, and given up.
inline std::string SeedUpload(const std::string& token) {
  const std::string tus = std::string("Tus-Resumable: ") + kTusVersion + "\r\n";
  const std::string part = tus + "Content-Type: " + kTusContentType + "\r\nUpload-Offset: ";
  return RequestOf("OPTIONS", "/v1/tus", token) +
         RequestOf(
             "POST", "/v1/tus", token,
             tus + "Upload-Length: 8\r\nUpload-Metadata: filename YS5qcGc=,camera c3RyZWV0\r\n") +
         RequestOf("PATCH", "/v1/tus/{upload}", token, part + "0\r\n", "abc") +
         RequestOf("PATCH", "/v1/tus/{upload}", token,
                   part + "3\r\nUpload-Checksum: sha1 qZk+NkcGgWq6PiVxeFDCbJzQ2J0=\r\n", "abc") +
         RequestOf("HEAD", "/v1/tus/{upload}", token, tus) +
         RequestOf("POST", "/v1/tus/{upload}", token,
                   part + "6\r\nX-HTTP-Method-Override: PATCH\r\n", "gh") +
         RequestOf("DELETE", "/v1/tus/{upload}", token, tus);
}

inline std::string SeedForm(const std::string& token) {
  const std::string photo = "Content-Type: image/jpeg\r\n\r\n" + SeedPhoto(3);
  const std::string field = "--b\r\nContent-Disposition: form-data; name=";
  const std::string body = field + "\"camera\"\r\n\r\nstreet\r\n" + field +
                           "\"photo\"; filename=\"c.jpg\"\r\n" + photo + "\r\n" + field +
                           "\"photo\"; filename=\"d.jpg\"\r\n" + photo + "\r\n--b--\r\n";
  return RequestOf("POST", "/v1/photos", token, "Content-Type: multipart/form-data; boundary=b\r\n",
                   body);
}

inline std::string SeedChunks(const std::string& token) {
  return RequestOf("POST", "/v1/contributions", token,
                   "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n") +
         "5\r\n{\"com\r\nB\r\nment\": \"a\"}\r\n0\r\n\r\n" +
         RequestOf("GET", "/v1/events?from=0", token,
                   "Last-Event-ID: 1\r\nConnection: close\r\nX-Request-Id: 7\r\n");
}

inline std::vector<std::string> HttpSeeds() {
  std::vector<std::string> seeds;
  for (const CityRoute& route : ListRoutes()) {
    seeds.push_back("0" + SeedRequest(route, ""));
    seeds.push_back("1" + SeedRequest(route, "{admin}"));
  }
  for (const auto& seed : {SeedVisit, SeedUpload, SeedForm, SeedChunks}) {
    seeds.push_back("0" + seed(""));
    for (const char* const token : {"{admin}", "{contributor}", "{viewer}", "{link}"})
      seeds.push_back("1" + seed(token));
  }
  return seeds;
}

}  // namespace veduta::fuzz
