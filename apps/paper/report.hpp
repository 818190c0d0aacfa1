// What vdvr-paper writes: numbers as JSON, tables as CSV, fields and pictures as files, and of each figure
// what scripts/paper-page needs to draw it. Every section measures one part of the paper, adds what it found,
// and keeps numbers that the table of claims needs. Called by main.cpp.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>
#include <nlohmann/json.hpp>

#include "apps/common/common_options.hpp"
#include "apps/common/output_folder.hpp"
#include "apps/paper/cases.hpp"
#include "vdvr/device.hpp"
#include "vdvr/expert/image.hpp"
#include "vdvr/expert/progress.hpp"
#include "vdvr/expert/spectral_error.hpp"

namespace vdvr::paper {

using cli::Json;

struct Table {
  std::string name;  ///< of the CSV file, without its extension
  std::string caption;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< each as long as the header
};
/// RFC 4180: header and rows, quoted where they need it.
std::string csv(const Table& table);

/// A part of the report. Figures in the form of docs/paper.md.
struct Section {
  std::string title;
  std::vector<std::string> paragraphs;
  std::vector<Json> figures;
  std::vector<Table> tables;
  std::vector<std::string> remarks;  ///< below the tables: where and why numbers differ
};

/// Frames per second of one method on one object.
struct SpeedRow {
  std::string object, method;
  std::uint64_t bytes = 0;  ///< on the device
  Speed speed;
  double times_d2vr = 1;  ///< D2VR's seconds a frame over this method's
  std::optional<ErrorMeasure> function;
};

struct Report {
  Device& device;
  Progress progress;
  bool quick = false;
  std::optional<std::filesystem::path> head;  ///< --head
  std::uint64_t max_memory = 0;               ///< --max-memory; 0: no limit
  Json json = Json::object();                 ///< by figure and table
  std::vector<Section> sections{};
  std::vector<std::pair<std::string, Image>> pictures{};     ///< NAME.png
  std::vector<std::pair<std::string, FloatImage>> fields{};  ///< NAME.npy
  std::vector<SpeedRow> speeds{};

  [[nodiscard]] int frames() const { return quick ? 2 : 8; }
};

/// Every file that any run or its page may write; what a run does not make is only taken away.
std::vector<std::string> file_names();
/// Whole or not at all: what an interruption or a full disk leaves is taken away again. paper.json comes last
/// and says that the folder is complete.
void write_report(const Report& run, cli::OutputFolder& folder);

// --- figures

/// Pictures of one size, `across` to a row, each below its title.
struct TitledPicture {
  std::string title;
  Image image;
};
Json pictures_figure(Report& run, const std::string& name, const std::string& caption,
                     std::vector<TitledPicture> pictures, std::size_t across);

/// Slices of one size side by side under one scale; values beyond it take the colour of its end.
struct Slice {
  std::string title;
  std::vector<float> values;  ///< [y][x]; row 0 is the least y
};
struct SliceScale {
  double low = 0, high = 1;
  const char* colours = "heat";  ///< heat | grey
  std::string label;
};
Json slices_figure(Report& run, const std::string& name, const std::string& caption,
                   const std::vector<Slice>& slices, std::int64_t side, const SliceScale& scale);

/// Curves over one axis.
struct Curve {
  std::string label;
  std::vector<std::array<double, 2>> points;  ///< x, y
};
struct Curves {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;
  bool logarithmic = false;  ///< in y
  bool marks = true;         ///< a dot on every point
};
Json curves_figure(const std::string& name, const std::string& caption, const Curves& curves);

// --- sections

/// Figs. 3, 4 and 5: projections.
void add_projection_errors(Report& run);
void add_spectra(Report& run, const ProjectionSet& scan, const Grid& grid, const std::string& name);
/// Fig. 5's pictures: the spectra of a row, of a projection and of the 1x volume, and what interpolation does
/// to them; adds figures to the section.
void add_spectrum_figures(Report& run, Section& section, const FilteredView& view, const Volume& base,
                          double range);

/// A certified or comparison volume of Marschner-Lobb with what was measured of it, interior.
struct LobbCase {
  Case made;
  ErrorMeasure function, field;
  Storage all, interior;
  Speed speed;
};
/// Marschner-Lobb and the fields that its figures share.
struct Lobb {
  TestScan test;
  Volume uniform;
  Grid lattice;
  std::vector<float> function, field;  ///< on the lattice
  std::vector<LobbCase> cases;

  [[nodiscard]] const LobbCase* find(Settings settings, double epsilon) const;
};
Lobb measure_lobb(Report& run);
/// Table 2's first part, and Figs. 12, 11, 13, 15 after it.
void add_thresholds(Report& run, const Lobb& lobb);
void add_error_maps(Report& run, const Lobb& lobb);
void add_equal_samples(Report& run, const Lobb& lobb);
void add_lobb_pictures(Report& run, const Lobb& lobb);
/// Frames per second of all methods on one object, in turn; rows for add_speeds.
void measure_speeds(Report& run, const std::string& object, const TestScan& test, const Case& made,
                    const MixedVolume& uniform, const TransferFunction& transfer);
void measure_lobb_speeds(Report& run, const Lobb& lobb);
void add_speeds(Report& run);

/// Fig. 10 and, where it was built, a row for Table 1.
void add_tumours(Report& run);
/// Fig. 14, Table 1 and Table 2's second part.
void add_objects(Report& run, const Lobb& lobb);

/// What the paper says beside what was found, from the JSON of the other sections.
void add_claims(Report& run);

// --- wording
/// "0.67 %" of 1
std::string percent(double value, int digits = 3);
std::string number(double value, int digits = 3);
/// "12 min", "8.3 s"
std::string duration(double seconds);
Json measure_json(const ErrorMeasure& m);
Json speed_json(const Speed& s);
Json case_json(const Case& c);

/// A picture of Marschner-Lobb's surface at 0.5 from above, which all of its figures share.
RenderOptions lobb_view(const Grid& grid, std::int64_t side);
/// With the sampler that the case's certificate allows.
RenderResult draw_case(Renderer& renderer, const Case& made, RenderOptions options);

}  // namespace vdvr::paper
