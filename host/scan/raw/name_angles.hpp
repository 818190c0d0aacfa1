// Angles that stand in the names of files.
#pragma once

#include <string>
#include <vector>

namespace vdvr::io {

/// What is wrong where names hold the angles of their views, or numbers at equal distances from these, and in
/// another order; where a name says that its number is an angle (deg, angle, theta) and these differ. Empty
/// where nothing is. Numbers that just count the files are none.
std::string names_against(const std::vector<std::string>& names, const std::vector<double>& angles_deg);

/// The angles that names hold: of the numbers in them the one that varies and is marked as an angle, by a
/// word, a sign or decimals, else the only one that varies. `why`: why there are none, then the list is
/// empty.
std::vector<double> angles_in_names(const std::vector<std::string>& names, std::string& why);

}  // namespace vdvr::io
