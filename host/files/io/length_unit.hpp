// Units of length by the names that files give them.
#pragma once

#include <optional>
#include <string>

namespace vdvr {

/// n where the unit is 10^n metres: "m", "cm", "mm", "um", "nm", "pm" and their long names, of either
/// spelling, in capitals, in the plural, with a micro sign in UTF-8 or Latin-1. Nothing where it is unknown.
std::optional<int> metres_exponent(const std::string& unit);

/// 10^n, the double nearest to it for |n| up to 22.
double power_of_ten(int n);

}  // namespace vdvr
