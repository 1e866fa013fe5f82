// The option --seeds of the evaluations.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace beckon {

struct Seeds {
  std::uint64_t first = 1;
  std::uint64_t last = 1;
};

// "A-B" or "A". Throws CLI::ValidationError.
inline Seeds ParseSeeds(const std::string& text) {
  try {
    // stoull would take a sign, and wrap a negative number.
    if (text.find_first_not_of("0123456789-") != std::string::npos || text.starts_with('-') ||
        text.find("--") != std::string::npos) {
      throw std::invalid_argument(text);
    }
    std::size_t used = 0;
    Seeds seeds;
    seeds.first = seeds.last = std::stoull(text, &used);
    if (used < text.size() && text[used] == '-') {
      const std::string rest = text.substr(used + 1);
      seeds.last = std::stoull(rest, &used);
      if (used == rest.size() && seeds.last >= seeds.first) return seeds;
    } else if (used == text.size()) {
      return seeds;
    }
  } catch (const std::logic_error&) {  // not a number, or too large a one
  }
  throw CLI::ValidationError("--seeds", "has to be A-B, for example 1-20");
}

// Adds --seeds, 1-20 where it is not given. `seeds` has to outlive the parsing.
inline void AddSeedsOption(CLI::App& app, Seeds& seeds) {
  seeds = {1, 20};
  app.add_option_function<std::string>(
         "--seeds", [&seeds](const std::string& text) { seeds = ParseSeeds(text); }, "A-B")
      ->default_str("1-20");
}

}  // namespace beckon
