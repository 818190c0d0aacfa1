// What reading a scan reports: what was understood, what is doubtful, what cannot be used.
#pragma once

#include <string>
#include <vector>

#include "host/scan/preprocess.hpp"
#include "host/scan/raw/raw_scan.hpp"
#include "host/scan/values.hpp"
#include "vdvr/read_scan.hpp"

namespace vdvr {

/// Values, first and last view, assumptions, and what options stated, with views as they are counted.
void describe(const io::RawScan& raw, const ScanOptions& options, Understood& report);

/// Refuses views that show nothing at all, and says how to leave them out.
[[noreturn]] void refuse_blank(const io::RawScan& raw, const std::vector<std::int64_t>& blank, double floor);

/// Warns where one sample in a hundred lies at `full`, the top of the converter's range (0: not known): what
/// was there is not known. (Single hot pixels do so always.)
void note_saturated(const FlatField& field, double full, const io::ValueTotals& totals,
                    std::int64_t flat_samples, Understood& report);

/// Refuses a scan of which a third of the samples are dead: what neighbours replace would be most of it.
void require_alive(const io::RawScan& raw, std::int64_t dead, std::int64_t samples, const std::string& name);

}  // namespace vdvr
