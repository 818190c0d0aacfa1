// What of a uniform volume is audited, as a field whose bricks all are at level 0, and what it is between its
// samples (docs/audit.md, "Between samples").
#pragma once

#include <cstdint>
#include <vector>

#include "host/field/fbp/coverage.hpp"
#include "vdvr/expert/audit.hpp"
#include "vdvr/expert/mixed_volume.hpp"

namespace vdvr {

/// The smallest box of a volume's samples that holds all that count: those whose place is covered and asked
/// for. What counts is convex, so a cell counts where its corners do.
class AuditedVolume {
 public:
  /// `whole` outlives this object. Throws InputError where no cell counts.
  AuditedVolume(const Volume& whole, const Coverage& coverage, const AuditOptions& options);

  /// The box as a field that is trilinear in its cells.
  [[nodiscard]] const MixedVolume& field() const { return field_; }
  [[nodiscard]] const Grid& grid() const { return field_.grid; }
  /// Of samples and cells of the box; along z all count.
  [[nodiscard]] bool sample_counts(std::int64_t x, std::int64_t y) const {
    return columns_[static_cast<std::size_t>(y * grid().samples()[0] + x)] != 0;
  }
  [[nodiscard]] bool cell_counts(std::int64_t x, std::int64_t y) const {
    return sample_counts(x, y) && sample_counts(x + 1, y) && sample_counts(x, y + 1) &&
           sample_counts(x + 1, y + 1);
  }
  /// For VerifyField.
  [[nodiscard]] std::vector<std::uint8_t> bricks_that_count() const;

  /// W in double precision, at a point in cells of the box that lies in it. Exactly halfway nearest takes the
  /// sample beyond.
  [[nodiscard]] double value_at(const Vec3& cells) const;
  /// By brick: at least the largest distance between W and the trilinear field in its cells that count. 0
  /// where W is that field. Cost: one pass over the samples.
  [[nodiscard]] std::vector<double> distance_from_linear(const Progress& progress) const;
  [[nodiscard]] Between between() const { return between_; }

 private:
  /// A sample of the whole volume, by its place in the box; beyond the volume that at the edge.
  [[nodiscard]] double sample(std::int64_t x, std::int64_t y, std::int64_t z) const;
  [[nodiscard]] double distance_in_cell(const Index3& cell) const;

  const Volume& whole_;
  Between between_;
  Index3 first_{0, 0, 0};
  MixedVolume field_;
  std::vector<std::uint8_t> columns_;
};

}  // namespace vdvr
