// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/photo_header.h"

#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "engine/camera/heif_file.h"
#include "engine/camera/tiff_tags.h"

namespace veduta {
namespace {

using Bytes = std::span<const uint8_t>;

constexpr std::array<uint8_t, 8> kPngSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

constexpr size_t kExifSizeMax = 1 << 16;  // what JPEG allows; more is no EXIF that anyone writes

bool StartsWith(Bytes bytes, Bytes prefix) {
  return bytes.size() >= prefix.size() && std::equal(prefix.begin(), prefix.end(), bytes.begin());
}
bool StartsWith(Bytes bytes, std::string_view prefix) {
  return StartsWith(bytes, Bytes(reinterpret_cast<const uint8_t*>(prefix.data()), prefix.size()));
}
uint32_t BigEndian16(Bytes bytes, size_t at) {
  return uint32_t{bytes[at]} << 8 | bytes[at + 1];
}
uint32_t BigEndian32(Bytes bytes, size_t at) {
  return BigEndian16(bytes, at) << 16 | BigEndian16(bytes, at + 2);
}

PhotoHeader Refused(PhotoFormat format, HeaderOutcome outcome, std::string detail) {
  PhotoHeader header;
  header.format = format;
  header.outcome = outcome;
  header.detail = std::move(detail);
  return header;
}
PhotoHeader Unreadable(PhotoFormat format, std::string detail) {
  return Refused(format, HeaderOutcome::kUnreadable, std::move(detail));
}

int OrientationFromTags(const std::optional<TiffTags>& tags) {
  const uint32_t orientation = tags ? tags->orientation.value_or(1) : 1;
  return orientation >= 1 && orientation <= 8 ? static_cast<int>(orientation) : 1;
}

// JPEG, ISO/IEC 10918-1 annex B.
// ---------------------------------------------------------------------------------

bool IsFrameMarker(uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

// Fills stored_size from a start of frame; says why the frame cannot be decoded, or nothing.
PhotoHeader ReadJpegFrame(uint8_t marker, Bytes frame, PhotoHeader header) {
  if (frame.size() < 6)
    return Unreadable(PhotoFormat::kJpeg, "the JPEG's frame header is too short");
  const int component_count = frame[5];
  std::string unsupported;
  if (marker > 0xC2) unsupported = "lossless, hierarchical or arithmetic coding";
  if (frame[0] != 8) unsupported = std::to_string(frame[0]) + " bits a sample";
  if (component_count != 1 && component_count != 3) {
    unsupported = component_count == 4 ? "CMYK colours (four components)"
                                       : std::to_string(component_count) + " components";
  }
  if (!unsupported.empty()) {
    return Refused(
        PhotoFormat::kJpeg, HeaderOutcome::kUnsupportedFormat,
        "a JPEG with " + unsupported + "; save it as an ordinary 8-bit RGB or grey JPEG");
  }
  header.stored_size = {BigEndian16(frame, 3), BigEndian16(frame, 1)};
  if (header.stored_size.empty())
    return Unreadable(PhotoFormat::kJpeg, "the JPEG's header declares no pixels");
  return header;
}

PhotoHeader ReadJpegHeader(Bytes bytes) {
  const auto cut_short = [] {
    return Unreadable(PhotoFormat::kJpeg, "the JPEG ends within its header");
  };
  PhotoHeader header;
  header.format = PhotoFormat::kJpeg;
  header.outcome = HeaderOutcome::kRead;
  bool has_exif = false;
  for (size_t at = 2;;) {
    while (at + 1 < bytes.size() && bytes[at] == 0xFF && bytes[at + 1] == 0xFF) ++at;  // fill bytes
    if (at + 4 > bytes.size()) return cut_short();
    if (bytes[at] != 0xFF) return Unreadable(PhotoFormat::kJpeg, "the JPEG's header is damaged");
    const uint8_t marker = bytes[at + 1];
    if (marker == 0xDA || marker == 0xD9) break;  // the first scan, or the end of the image
    at += 2;
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue;  // these stand alone
    const size_t length = BigEndian16(bytes, at);
    if (length < 2 || length > bytes.size() - at) return cut_short();
    const Bytes segment = bytes.subspan(at + 2, length - 2);
    at += length;
    if (IsFrameMarker(marker) && header.stored_size.empty()) {
      header = ReadJpegFrame(marker, segment, header);
      if (header.outcome != HeaderOutcome::kRead) return header;
    } else if (marker == 0xE1 && !has_exif &&
               StartsWith(segment, std::string_view("Exif\0\0", 6))) {
      has_exif = true;
      header.exif.assign(segment.begin() + 6, segment.end());
      header.orientation = OrientationFromTags(ReadTiffTags(header.exif));
    } else if (marker == 0xDD && segment.size() >= 2) {
      header.has_restarts = BigEndian16(segment, 0) != 0;
    }
  }
  if (header.stored_size.empty())
    return Unreadable(PhotoFormat::kJpeg, "the JPEG has no frame header");
  return header;
}

// PNG, third edition, sections 5 and 11.
// --------------------------------------------------------------------------

// CRC-32 of a chunk's type and data. Bit by bit: it is taken of the small eXIf chunk alone.
uint32_t ChunkCrc(Bytes bytes) {
  uint32_t crc = ~0u;
  for (const uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

PhotoHeader ReadPngHeader(Bytes bytes) {
  constexpr size_t kHeaderEnd = 8 + 25;  // signature and IHDR
  if (bytes.size() < kHeaderEnd)
    return Unreadable(PhotoFormat::kPng, "the PNG ends within its header");
  if (BigEndian32(bytes, 8) != 13 || !StartsWith(bytes.subspan(12), "IHDR")) {
    return Unreadable(PhotoFormat::kPng, "the PNG does not start with its header");
  }
  PhotoHeader header;
  header.format = PhotoFormat::kPng;
  header.outcome = HeaderOutcome::kRead;
  header.stored_size = {BigEndian32(bytes, 16), BigEndian32(bytes, 20)};
  if (header.stored_size.empty())
    return Unreadable(PhotoFormat::kPng, "the PNG's header declares no pixels");
  for (size_t at = kHeaderEnd; bytes.size() - at >= 12;) {
    const size_t length = BigEndian32(bytes, at);
    if (length > bytes.size() - at - 12) break;  // cut short: the decoder will say so
    const Bytes type_and_data = bytes.subspan(at + 4, 4 + length);
    if (StartsWith(type_and_data, "IEND")) break;
    if (StartsWith(type_and_data, "eXIf") && length <= kExifSizeMax &&
        ChunkCrc(type_and_data) == BigEndian32(bytes, at + 8 + length)) {
      header.exif.assign(type_and_data.begin() + 4, type_and_data.end());
      header.orientation = OrientationFromTags(ReadTiffTags(header.exif));
      break;
    }
    at += 12 + length;
  }
  return header;
}

PhotoHeader ReadTiffHeader(Bytes bytes) {
  const std::optional<TiffTags> tags = ReadTiffTags(bytes);
  if (!tags)
    return Unreadable(PhotoFormat::kTiff, "the TIFF's directory of tags is damaged or cut off");
  PhotoHeader header;
  header.format = PhotoFormat::kTiff;
  header.outcome = HeaderOutcome::kRead;
  header.stored_size = {tags->width_px.value_or(0), tags->height_px.value_or(0)};
  header.orientation = OrientationFromTags(tags);
  if (header.stored_size.empty())
    return Unreadable(PhotoFormat::kTiff, "the TIFF declares no pixels");
  header.exif = ExifOfTiff(bytes);
  return header;
}

// WebP, RFC 9649.
// ------------------------------------------------------------------------------------------------

uint32_t LittleEndian32(Bytes bytes, size_t at) {
  return bytes[at] | uint32_t{bytes[at + 1]} << 8 | uint32_t{bytes[at + 2]} << 16 |
         uint32_t{bytes[at + 3]} << 24;
}

bool IsWebp(Bytes bytes) {
  return bytes.size() >= 16 && StartsWith(bytes, "RIFF") && StartsWith(bytes.subspan(8), "WEBP");
}

// The EXIF chunk, which stands behind the picture. Some writers begin it as JPEG does.
Bytes FindWebpExif(Bytes bytes) {
  constexpr std::string_view kJpegStart("Exif\0\0", 6);
  for (size_t at = 12; bytes.size() - at >= 8;) {
    const size_t length = LittleEndian32(bytes, at + 4);
    if (length > bytes.size() - at - 8) break;  // cut short: the decoder will say so
    const Bytes data = bytes.subspan(at + 8, length);
    if (StartsWith(bytes.subspan(at), "EXIF"))
      return StartsWith(data, kJpegStart) ? data.subspan(kJpegStart.size()) : data;
    at = std::min(bytes.size(), at + 8 + length + length % 2);
  }
  return {};
}

PhotoHeader ReadWebpHeader(Bytes bytes) {
  WebPBitstreamFeatures features;
  switch (WebPGetFeatures(bytes.data(), bytes.size(), &features)) {
    case VP8_STATUS_OK:
      break;
    case VP8_STATUS_UNSUPPORTED_FEATURE:
      return Refused(PhotoFormat::kWebp, HeaderOutcome::kUnsupportedFormat,
                     "a WebP of a kind that is not read; save it as a JPEG");
    default:
      return Unreadable(PhotoFormat::kWebp, "the WebP's header is damaged or cut off");
  }
  if (features.has_animation) {
    return Refused(PhotoFormat::kWebp, HeaderOutcome::kUnsupportedFormat,
                   "an animated WebP; save one of its pictures");
  }
  PhotoHeader header;
  header.format = PhotoFormat::kWebp;
  header.outcome = HeaderOutcome::kRead;
  header.stored_size = {static_cast<uint32_t>(features.width),
                        static_cast<uint32_t>(features.height)};
  if (header.stored_size.empty())
    return Unreadable(PhotoFormat::kWebp, "the WebP's header declares no pixels");
  if (const Bytes exif = FindWebpExif(bytes); exif.size() <= kExifSizeMax) {
    header.exif.assign(exif.begin(), exif.end());
    header.orientation = OrientationFromTags(ReadTiffTags(header.exif));
  }
  return header;
}

PhotoHeader ReadHeifHeader(Bytes bytes) {
  const HeifFile file = OpenHeif(bytes);
  switch (file.failure.outcome) {
    case HeifOutcome::kRead:
      break;
    case HeifOutcome::kUnsupported:
      return Refused(PhotoFormat::kHeif, HeaderOutcome::kUnsupportedFormat, file.failure.detail);
    case HeifOutcome::kUnreadable:
      return Unreadable(PhotoFormat::kHeif, file.failure.detail);
    case HeifOutcome::kNoMemory:
      return Refused(PhotoFormat::kHeif, HeaderOutcome::kNoMemory, {});
  }
  PhotoHeader header;
  header.format = PhotoFormat::kHeif;
  header.outcome = HeaderOutcome::kRead;
  header.stored_size = file.Size();
  if (header.stored_size.empty())
    return Unreadable(PhotoFormat::kHeif, "the HEIF's header declares no pixels");
  header.exif = file.Exif();
  header.sensor_orientation = OrientationFromTags(ReadTiffTags(header.exif));
  return header;
}

}  // namespace

const char* MediaTypeOf(PhotoFormat format) {
  switch (format) {
    case PhotoFormat::kJpeg:
      return "image/jpeg";
    case PhotoFormat::kPng:
      return "image/png";
    case PhotoFormat::kTiff:
      return "image/tiff";
    case PhotoFormat::kWebp:
      return "image/webp";
    case PhotoFormat::kHeif:
      return "image/heic";
    case PhotoFormat::kUnknown:
      break;
  }
  return "application/octet-stream";
}

namespace {

PhotoHeader ReadAnyHeader(Bytes bytes) {
  if (StartsWith(bytes, "\xFF\xD8\xFF")) return ReadJpegHeader(bytes);
  if (StartsWith(bytes, kPngSignature)) return ReadPngHeader(bytes);
  if (StartsWith(bytes, std::string_view("II*\0", 4)) ||
      StartsWith(bytes, std::string_view("MM\0*", 4))) {
    return ReadTiffHeader(bytes);
  }
  if (StartsWith(bytes, std::string_view("II+\0", 4)) ||
      StartsWith(bytes, std::string_view("MM\0+", 4))) {
    return Refused(PhotoFormat::kUnknown, HeaderOutcome::kUnsupportedFormat,
                   "the file is a BigTIFF; save it as a JPEG, PNG or classic TIFF");
  }
  if (IsWebp(bytes)) return ReadWebpHeader(bytes);
  if (IsHeif(bytes)) return ReadHeifHeader(bytes);
  return Refused(PhotoFormat::kUnknown, HeaderOutcome::kUnsupportedFormat, kNoPhotoText);
}

}  // namespace

PhotoHeader ReadPhotoHeader(Bytes bytes) {
  PhotoHeader header = ReadAnyHeader(bytes);
  if (header.format != PhotoFormat::kHeif) header.sensor_orientation = header.orientation;
  return header;
}

}  // namespace veduta
