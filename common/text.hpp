// Numbers in sentences.
#pragma once

#include <string>

namespace beckon {

// As std::printf would print it.
[[gnu::format(printf, 1, 2)]] std::string Format(const char* format, ...);

}  // namespace beckon
