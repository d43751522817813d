// SPDX-License-Identifier: Apache-2.0
#pragma once
// The fields of an options struct as a list that the compiler keeps complete.
//
// After the struct, at namespace scope:
//
//   VEDUTA_OPTION_FIELDS(SolverOptions, lambda, iterations_max, check_every, gap_max)
//
// names all of its fields, in their order. A field that is missing in the list, or one too many,
// does not compile, because the list is a structured binding of the whole struct. Whoever feeds a
// hash, or a test that flips every field, walks along this list and can therefore leave none out.

#include <algorithm>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "storage/base/content_feed.h"

#define VEDUTA_OPTION_FIELDS(Struct, ...)               \
  inline auto FieldsOf(Struct& options) {               \
    auto& [__VA_ARGS__] = options;                      \
    return std::tie(__VA_ARGS__);                       \
  }                                                     \
  inline auto FieldsOf(const Struct& options) {         \
    const auto& [__VA_ARGS__] = options;                \
    return std::tie(__VA_ARGS__);                       \
  }                                                     \
  inline std::string_view FieldNamesOf(const Struct*) { \
    return #__VA_ARGS__;                                \
  }

namespace veduta {

template <typename T>
concept HasOptionFields = requires(T& options) {
  FieldsOf(options);
};

// The names in the list, in their order.
template <HasOptionFields Options>
std::vector<std::string> OptionFieldNames() {
  std::vector<std::string> names;
  std::string_view list = FieldNamesOf(static_cast<const Options*>(nullptr));
  for (;;) {
    const size_t end = std::min(list.find(','), list.size());
    names.emplace_back(list.substr(0, end));
    if (end == list.size()) return names;
    list.remove_prefix(end + 1);
    while (!list.empty() && list.front() == ' ') list.remove_prefix(1);
  }
}

// Calls visit(name, field) for each number, in order; the fields of a struct within the struct are
// visited as "outer.inner".
template <HasOptionFields Options, typename Visit>
void VisitOptionFields(Options& options, const std::string& prefix, const Visit& visit) {
  const std::vector<std::string> names = OptionFieldNames<std::remove_const_t<Options>>();
  size_t index = 0;
  const auto one = [&](auto& field) {
    const std::string name = prefix + names[index++];
    if constexpr (HasOptionFields<std::remove_reference_t<decltype(field)>>) {
      VisitOptionFields(field, name + ".", visit);
    } else {
      visit(name, field);
    }
  };
  std::apply([&](auto&... fields) { (one(fields), ...); }, FieldsOf(options));
}

// Feeds every field, those of structs within it too.
template <HasOptionFields Options>
void FeedOptionFields(const Options& options, ContentFeed* feed) {
  VisitOptionFields(options, "", [&](const std::string&, const auto& field) { *feed << field; });
}

}  // namespace veduta
