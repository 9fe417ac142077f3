#pragma once

#include "common/dds/topic.hpp"

#include <fmt/core.h>

#include <cmath>
#include <cstddef>
#include <string_view>

namespace breakshot::dds {

/// Checks the fields of a sample that came from outside, one after the other; remembers the first that fails, with what is allowed.
class Door {
 public:
  void finite(std::string_view field, double value) {
    if (!std::isfinite(value)) fail(fmt::format("{} is {}; allowed: a finite number", field, value));
  }
  void within(std::string_view field, double value, double low, double high) {
    if (!(value >= low && value <= high)) fail(fmt::format("{} is {}; allowed: {} to {}", field, value, low, high));
  }
  /// For enumerations, which travel as numbers: valid values are 0 to last.
  void enumerated(std::string_view field, unsigned value, unsigned last) {
    if (value > last) fail(fmt::format("{} is {}; allowed: 0 to {}", field, value, last));
  }
  void at_most(std::string_view field, std::size_t count, std::size_t most) {
    if (count > most) fail(fmt::format("{} has {} elements; allowed: at most {}", field, count, most));
  }
  template <typename Range>
  void all_finite(std::string_view field, const Range& values) {
    for (const double value : values) finite(field, value);
  }
  void check(bool good, std::string_view what) {
    if (!good) fail(std::string{what});
  }

  bool good() const noexcept { return why_.empty(); }
  const Invalid& why() const noexcept { return why_; }

 private:
  void fail(Invalid why) {
    if (why_.empty()) why_ = std::move(why);
  }
  Invalid why_;
};

/// Cuts a text to what a bounded IDL string holds; Fast CDR would throw on more.
inline std::string_view fit(std::string_view text, std::size_t most) { return text.substr(0, most); }

}  // namespace breakshot::dds
