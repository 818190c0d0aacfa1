// The sections of `bench paper`: each measures one part of the paper, adds what it found to the page and to
// the JSON, and keeps numbers that the table of claims needs. Called by bench_paper.cpp.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/vdvr/output.hpp"
#include "host/field_panels.hpp"
#include "host/page.hpp"
#include "host/paper_cases.hpp"
#include "vdvr/device.hpp"
#include "vdvr/progress.hpp"

namespace vdvr::cli {

/// Frames per second of one method on one object.
struct SpeedRow {
  std::string object, method;
  std::uint64_t bytes = 0;  ///< on the device
  paper::Speed speed;
  double times_d2vr = 1;  ///< D2VR's seconds a frame over this method's
  std::optional<ErrorMeasure> function;
};

struct PaperRun {
  Device& device;
  Progress progress;
  bool quick = false;
  std::optional<std::filesystem::path> head;  ///< --head
  std::uint64_t max_memory = 0;               ///< --max-memory; 0: no limit
  Page page{};
  Json json = Json::object();  ///< by figure and table
  std::vector<SpeedRow> speeds{};

  [[nodiscard]] int frames() const { return quick ? 2 : 8; }
};

/// Figs. 3, 4 and 5: projections.
void add_projection_errors(PaperRun& run);
void add_spectra(PaperRun& run, const ProjectionSet& scan, const Grid& grid, const std::string& name);

/// A certified or comparison volume of Marschner-Lobb with what was measured of it, interior.
struct LobbCase {
  paper::Case made;
  ErrorMeasure function, field;
  Storage all, interior;
  paper::Speed speed;
};
/// Marschner-Lobb and the fields that its figures share.
struct Lobb {
  paper::TestScan test;
  Volume uniform;
  Grid lattice;
  std::vector<float> function, field;  ///< on the lattice
  std::vector<LobbCase> cases;

  [[nodiscard]] const LobbCase* find(paper::Settings settings, double epsilon) const;
};
Lobb measure_lobb(PaperRun& run);
/// Table 2's first part, and Figs. 12, 11, 13, 15 after it.
void add_thresholds(PaperRun& run, const Lobb& lobb);
void add_error_maps(PaperRun& run, const Lobb& lobb);
void add_equal_samples(PaperRun& run, const Lobb& lobb);
void add_lobb_pictures(PaperRun& run, const Lobb& lobb);
/// Frames per second of all methods on one object, in turn; rows for add_speeds.
void measure_speeds(PaperRun& run, const std::string& object, const paper::TestScan& test,
                    const paper::Case& made, const MixedVolume& uniform, const TransferFunction& transfer);
void measure_lobb_speeds(PaperRun& run, const Lobb& lobb);
void add_speeds(PaperRun& run);

/// Fig. 10 and, where it was built, a row for Table 1.
void add_tumours(PaperRun& run);
/// Fig. 14, Table 1 and Table 2's second part.
void add_objects(PaperRun& run, const Lobb& lobb);

/// What the paper says beside what was found, from the JSON of the other sections.
void add_claims(PaperRun& run);

// --- wording
/// "0.67 %" of 1
std::string percent(double value, int digits = 3);
std::string number(double value, int digits = 3);
/// "12 min", "8.3 s"
std::string duration(double seconds);
Json measure_json(const ErrorMeasure& m);
Json speed_json(const paper::Speed& s);
Json case_json(const paper::Case& c);

/// A picture of Marschner-Lobb's surface at 0.5 from above, which all of its figures share.
RenderOptions lobb_view(const Grid& grid, std::int64_t side);
/// With the sampler that the case's certificate allows.
RenderResult draw_case(PaperRun& run, const ResidentVolume& resident, const paper::Case& made,
                       RenderOptions options);

}  // namespace vdvr::cli
