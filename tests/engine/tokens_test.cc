// SPDX-License-Identifier: Apache-2.0
// Goal: a token is known by its text until it expires or is revoked, and by nothing else; the
//   database holds no text that lets anybody in.
// Method: tokens in a database, their texts changed in every place; the files of the database are
//   searched for the secret.
#include "engine/door/tokens.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

TokenRequest Request(const std::string& name, Role role, int64_t expires_unix_s = 0) {
  TokenRequest request;
  request.name = name;
  request.role = role;
  request.expires_unix_s = expires_unix_s;
  request.actor = "owner";
  return request;
}

NewToken Make(City* city, const std::string& name, Role role, int64_t expires_unix_s = 0) {
  const auto made = city->engine().CreateToken(Request(name, role, expires_unix_s));
  EXPECT_OK(made);
  return made.ok() ? *made : NewToken();
}

std::optional<TokenAnswer> Check(const City& city, const std::string& text) {
  const auto checked = city.Ask().door().CheckToken(text);
  EXPECT_OK(checked);
  return checked.ok() ? *checked : std::nullopt;
}

TEST(Tokens, AreKnownByTheirTextAlone) {
  City city;
  EXPECT_TRUE(city.Ask().door().Tokens()->empty());
  const NewToken anna = Make(&city, "anna", Role::kContributor);
  const NewToken bela = Make(&city, "bela", Role::kCurator);
  EXPECT_EQ(anna.number, 1u);
  EXPECT_EQ(bela.number, 2u);
  const auto found = Check(city, bela.text);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->name, "bela");
  EXPECT_EQ(found->role, Role::kCurator);
  EXPECT_EQ(Check(city, anna.text)->name, "anna");
  for (size_t i = 0; i < anna.text.size(); ++i) {
    std::string changed = anna.text;
    changed[i] = changed[i] == 'A' ? 'B' : 'A';
    EXPECT_FALSE(Check(city, changed)) << i;
    EXPECT_FALSE(Check(city, anna.text.substr(0, i))) << i;
  }
  EXPECT_FALSE(Check(city, anna.text + "A"));
  std::string longer = anna.text;
  EXPECT_FALSE(Check(city, longer.insert(anna.text.find('1'), "0"))) << "a token has one spelling";
  // The secret of one under the number of another.
  std::string exchanged = anna.text;
  exchanged[anna.text.find('1')] = '2';
  EXPECT_FALSE(Check(city, exchanged));
  for (const char* text : {"", "veduta-", "veduta-1", "veduta-1-", "veduta--1-x", "veduta-9-abc",
                           "veduta-99999999999-abc", "veduta-0-"})
    EXPECT_FALSE(Check(city, text)) << text;
}

TEST(Tokens, EndWhenTheyExpireOrAreRevoked) {
  City city;
  const NewToken past = Make(&city, "anna", Role::kViewer, std::time(nullptr) - 1);
  const NewToken future = Make(&city, "anna", Role::kViewer, std::time(nullptr) + 1000);
  EXPECT_FALSE(Check(city, past.text));
  EXPECT_TRUE(Check(city, future.text));
  ASSERT_OK(city.engine().RevokeToken(future.number, "owner"));
  EXPECT_FALSE(Check(city, future.text));
  ASSERT_OK(city.engine().RevokeToken(future.number, "owner"));  // again: nothing
  EXPECT_EQ(city.engine().RevokeToken(9, "owner").code(), StatusCode::kNotFound);
  const auto all = city.Ask().door().Tokens();
  ASSERT_OK(all);
  ASSERT_EQ(all->size(), 2u);
  EXPECT_EQ((*all)[0].revoked_unix_s, 0);
  EXPECT_GT((*all)[1].revoked_unix_s, 0);
  EXPECT_EQ(Make(&city, "anna", Role::kViewer).number, 3u) << "no number is given twice";
  const auto journal = city.Ask().door().Journal(1, 100);
  ASSERT_OK(journal);
  EXPECT_EQ(std::ranges::count(*journal, "token", &JournalAnswer::action), 4);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Tokens, AreNoPartOfTheCityAndOutliveTheProcess) {
  City city;
  const std::string digest = city.Digest();
  const NewToken token = Make(&city, "anna", Role::kAdmin);
  EXPECT_EQ(city.Digest(), digest);
  city.Reopen();
  EXPECT_TRUE(Check(city, token.text));
  const std::string secret = token.text.substr(token.text.rfind('-', token.text.size() - 43) + 1);
  ASSERT_GE(secret.size(), 40u);
  city.Close();
  for (const auto& entry : std::filesystem::recursive_directory_iterator(city.path())) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(bytes.find(secret.substr(0, 20)), std::string::npos) << entry.path();
  }
}

TEST(Tokens, RequestsKeepTheirBounds) {
  City city;
  const auto refused = [&](const TokenRequest& request, const char* what) {
    const auto made = city.engine().CreateToken(request);
    EXPECT_EQ(made.status().code(), StatusCode::kInvalidArgument) << what;
    EXPECT_NE(made.status().message().find(what), std::string::npos) << made.status().message();
  };
  refused(Request("", Role::kViewer), "name");
  refused(Request(std::string(101, 'x'), Role::kViewer), "name");
  refused(Request("anna", static_cast<Role>(0)), "role");
  refused(Request("anna", static_cast<Role>(5)), "role");
  refused(Request("anna", Role::kViewer, -1), "expires_unix_s");
}

TEST(Tokens, RolesHaveWords) {
  for (const Role role : {Role::kViewer, Role::kContributor, Role::kCurator, Role::kAdmin}) {
    const auto parsed = ParseRole(RoleWord(role));
    ASSERT_OK(parsed);
    EXPECT_EQ(*parsed, role);
  }
  EXPECT_EQ(ParseRole("king").status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(RoleWord(static_cast<Role>(9)), "unknown");
}

TEST(Tokens, SecretsDiffer) {
  City city;
  std::set<std::string> texts;
  for (int i = 0; i < 20; ++i) texts.insert(Make(&city, "anna", Role::kViewer).text.substr(9));
  EXPECT_EQ(texts.size(), 20u);
}

TEST(Tokens, ALinkIsAViewersAndExpires) {
  City city;
  TokenRequest request = Request("council", Role::kViewer, std::time(nullptr) + 1000);
  request.is_link = true;
  const auto made = city.engine().CreateToken(request);
  ASSERT_OK(made);
  const auto found = Check(city, made->text);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->is_link);
  request.role = Role::kContributor;
  EXPECT_EQ(city.engine().CreateToken(request).status().code(), StatusCode::kInvalidArgument);
  request.role = Role::kViewer;
  request.expires_unix_s = 0;
  EXPECT_EQ(city.engine().CreateToken(request).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
