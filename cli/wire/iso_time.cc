// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/iso_time.h"

#include <chrono>
#include <cstdio>

namespace veduta {
namespace {

// A moment between two seconds has a fraction.
struct Moment {
  int64_t unix_s = 0;
  bool has_fraction = false;
};

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

// Takes a number of so many digits from the front; nothing where there is none.
std::optional<int> TakeNumber(std::string_view* text, size_t digits) {
  if (text->size() < digits) return std::nullopt;
  int number = 0;
  for (size_t i = 0; i < digits; ++i) {
    if (!IsDigit((*text)[i])) return std::nullopt;
    number = 10 * number + ((*text)[i] - '0');
  }
  text->remove_prefix(digits);
  return number;
}

bool TakeOneOf(std::string_view* text, std::string_view letters) {
  if (text->empty() || letters.find(text->front()) == letters.npos) return false;
  text->remove_prefix(1);
  return true;
}

// "Z" or "+01:00", in seconds; all that is left of the text.
std::optional<int> TakeOffset(std::string_view* text) {
  if (TakeOneOf(text, "Zz")) return text->empty() ? std::optional(0) : std::nullopt;
  const int sign = text->starts_with('-') ? -1 : 1;
  if (!TakeOneOf(text, "+-")) return std::nullopt;
  const auto hours = TakeNumber(text, 2);
  if (!hours || *hours > 23 || !TakeOneOf(text, ":")) return std::nullopt;
  const auto minutes = TakeNumber(text, 2);
  if (!minutes || *minutes > 59 || !text->empty()) return std::nullopt;
  return sign * 60 * (60 * *hours + *minutes);
}

std::optional<Moment> ParseMoment(std::string_view text) {
  int numbers[6];
  constexpr const char* kBetween[6] = {"-", "-", "Tt ", ":", ":", ""};
  for (int i = 0; i < 6; ++i) {
    const auto number = TakeNumber(&text, i == 0 ? 4 : 2);
    if (!number || (i < 5 && !TakeOneOf(&text, kBetween[i]))) return std::nullopt;
    numbers[i] = *number;
  }
  Moment moment;
  if (TakeOneOf(&text, ".")) {
    if (text.empty() || !IsDigit(text.front())) return std::nullopt;
    for (; !text.empty() && IsDigit(text.front()); text.remove_prefix(1))
      moment.has_fraction |= text.front() != '0';
  }
  const auto offset_s = TakeOffset(&text);
  const std::chrono::year_month_day day{std::chrono::year(numbers[0]),
                                        std::chrono::month(static_cast<unsigned>(numbers[1])),
                                        std::chrono::day(static_cast<unsigned>(numbers[2]))};
  // 60: a second that is put in now and then.
  const bool is_time = numbers[3] <= 23 && numbers[4] <= 59 && numbers[5] <= 60;
  if (!offset_s || !day.ok() || !is_time) return std::nullopt;
  const auto days = std::chrono::sys_days(day).time_since_epoch();
  moment.unix_s = std::chrono::seconds(days).count() + 3600 * numbers[3] + 60 * numbers[4] +
                  numbers[5] - *offset_s;
  return moment;
}

Status Wrong(std::string_view text) {
  return Status::InvalidArgument("'datetime' is '" + std::string(text.substr(0, 100)) +
                                 "', and must be a time like 2026-11-26T12:00:00Z, or two of them "
                                 "with a slash between, one of which may be '..'");
}

}  // namespace

std::string IsoTime(int64_t unix_s) {
  using std::chrono::floor;
  const std::chrono::sys_seconds time{std::chrono::seconds(unix_s)};
  const auto day = floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(time - day);
  char text[64];
  std::snprintf(text, sizeof(text), "%04d-%02u-%02uT%02d:%02d:%02dZ", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()));
  return text;
}

Result<TimeInterval> ParseInterval(std::string_view text) {
  const size_t slash = text.find('/');
  const std::string_view first = text.substr(0, slash);
  const std::string_view last = slash == text.npos ? first : text.substr(slash + 1);
  const auto is_open = [&](std::string_view one) {
    return slash != text.npos && (one.empty() || one == "..");
  };
  if (is_open(first) && is_open(last)) return Wrong(text);
  TimeInterval interval;
  if (!is_open(first)) {
    const auto moment = ParseMoment(first);
    if (!moment) return Wrong(text);
    interval.from_unix_s = moment->unix_s + (moment->has_fraction ? 1 : 0);
  }
  if (!is_open(last)) {
    const auto moment = ParseMoment(last);
    if (!moment) return Wrong(text);
    interval.to_unix_s = moment->unix_s;
  }
  const bool is_turned = slash != text.npos && interval.from_unix_s && interval.to_unix_s &&
                         *interval.from_unix_s > *interval.to_unix_s;
  if (is_turned) return Status::InvalidArgument("'datetime' ends before it begins");
  return interval;
}

}  // namespace veduta
