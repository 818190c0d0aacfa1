#include "host/certify/crew/crew_messages.hpp"

#include <cstddef>
#include <cstring>
#include <utility>

#include "host/base/system/casts.hpp"

namespace vdvr {
namespace {

template <class T>
void put_struct(ByteWriter& out, const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<std::byte> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  out.put(bytes);
}
template <class T>
std::vector<T> get_struct(ByteReader& in) {
  const auto bytes = in.get_vector<std::byte>();
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

template <std::size_t n>
void put(ByteWriter& out, const std::array<double, n>& values) {
  for (const double v : values) out.put(v);
}
template <std::size_t n>
void get(ByteReader& in, std::array<double, n>& values) {
  for (double& v : values) v = in.get<double>();
}

void put(ByteWriter& out, const Grid& grid) {
  out.put(grid.cells);
  put(out, grid.origin);
  put(out, grid.spacing);
  vdvr::put(out, grid.unit);
}
Grid get_grid(ByteReader& in) {
  Grid grid;
  grid.cells = in.get<Index3>();
  get(in, grid.origin);
  get(in, grid.spacing);
  grid.unit = get_text(in);
  return grid;
}

void put(ByteWriter& out, const ParallelGeometry& g) {
  out.put(g.columns);
  out.put(g.rows);
  for (const double v : {g.pitch_u, g.pitch_v, g.center}) out.put(v);
  vdvr::put(out, g.unit);
  out.put(g.theta_rad);
}
ParallelGeometry get_geometry(ByteReader& in) {
  ParallelGeometry g;
  g.columns = in.get<std::int64_t>();
  g.rows = in.get<std::int64_t>();
  for (double* v : {&g.pitch_u, &g.pitch_v, &g.center}) *v = in.get<double>();
  g.unit = get_text(in);
  g.theta_rad = in.get_vector<double>();
  return g;
}

void put(ByteWriter& out, const IntegerLattice& l) {
  out.put(l.step);
  out.put(static_cast<std::uint8_t>(l.base));
  out.put(static_cast<std::uint8_t>(l.least));
  out.put(l.base_shift);
  out.put(l.finest_shift);
}
IntegerLattice get_lattice(ByteReader& in) {
  IntegerLattice l;
  l.step = in.get<double>();
  l.base = static_cast<SampleType>(in.get<std::uint8_t>());
  l.least = static_cast<SampleType>(in.get<std::uint8_t>());
  l.base_shift = in.get<int>();
  l.finest_shift = in.get<int>();
  return l;
}

void put(ByteWriter& out, const GoldSettings& s) {
  put(out, s.grid);
  for (const int n : {s.granularity, s.rate, s.upsampling, static_cast<int>(s.interpolation)}) out.put(n);
  out.put(static_cast<std::uint8_t>(s.window.has_value()));
  if (s.window) {
    out.put(s.window->first);
    out.put(s.window->second);
  }
  for (const bool flag : {s.midrange, s.anisotropic, s.base_only, s.grid_only})
    out.put(static_cast<std::uint8_t>(flag));
  out.put(s.curvature);
  out.put(s.coarse_rate);
  out.put(s.finer_rate);
  out.put(s.coarsening);
  out.put(s.heights_bytes);
  out.put(s.least_reach);
}
GoldSettings get_settings(ByteReader& in) {
  GoldSettings s;
  s.grid = get_grid(in);
  for (int* n : {&s.granularity, &s.rate, &s.upsampling}) *n = in.get<int>();
  s.interpolation = static_cast<Interpolation>(in.get<int>());
  if (in.get<std::uint8_t>() != 0) {
    const double low = in.get<double>();
    s.window = {low, in.get<double>()};
  }
  for (bool* flag : {&s.midrange, &s.anisotropic, &s.base_only, &s.grid_only})
    *flag = in.get<std::uint8_t>() != 0;
  s.curvature = in.get<float>();
  s.coarse_rate = in.get<int>();
  s.finer_rate = in.get<int>();
  s.coarsening = in.get<LevelTriple>();
  s.heights_bytes = in.get<std::uint64_t>();
  s.least_reach = in.get<double>();
  return s;
}

void put_shape(ByteWriter& out, const SampleBlock& block) {
  out.put(static_cast<std::uint8_t>(block.type));
  out.put(block.size());
  out.put(block.offset);
  out.put(block.shift);
}
SampleBlock get_block(ByteReader& in, const MemoryBudget& budget) {
  SampleBlock block;
  block.type = static_cast<SampleType>(in.get<std::uint8_t>());
  const auto n = in.get<std::uint64_t>();
  const auto scratch = budget.for_bytes(n * block.sample_bytes());
  if (block.type == SampleType::f32) block.f32 = {n, scratch, "a field to measure"};
  else if (block.type == SampleType::u16) block.u16 = {n, scratch, "a field to measure"};
  else block.u8 = {n, scratch, "a field to measure"};
  block.offset = in.get_vector<std::int32_t>();
  block.shift = in.get_vector<std::uint8_t>();
  return block;
}

void put(ByteWriter& out, const FilterProbe& p) {
  out.put(static_cast<std::uint8_t>(p.image3d));
  for (const double v : {p.weight_error, p.delta, p.constant_error}) out.put(v);
  for (const double v : p.by_steps) out.put(v);
}
void get(ByteReader& in, FilterProbe& p) {
  p.image3d = in.get<std::uint8_t>() != 0;
  for (double* v : {&p.weight_error, &p.delta, &p.constant_error}) *v = in.get<double>();
  for (double& v : p.by_steps) v = in.get<double>();
}

}  // namespace

void put(ByteWriter& out, const std::string& text) { out.put(std::vector<char>(text.begin(), text.end())); }
std::string get_text(ByteReader& in) {
  const auto text = in.get_vector<char>();
  return {text.begin(), text.end()};
}
void put(ByteWriter& out, CrewWord word) { out.put(static_cast<std::uint8_t>(word)); }

void put_scan(ByteWriter& out, const FilteredScan& scan, const FieldSups& sups,
              const GoldSettings& settings) {
  put(out, scan.geometry);
  put_struct(out, scan.views);
  out.put(scan.fft_length);
  out.put(scan.view_max);
  out.put(scan.ramp_error);
  for (const double v :
       {sups.value, sups.second_u, sups.second_v, sups.sampled_second_u, sups.sampled_second_v})
    out.put(v);
  put_struct(out, sups.by_view);
  put(out, settings);
}

Bytes message_to_open(CrewWord word, const CrewOptions& options) {
  ByteWriter out;
  put(out, word);
  put(out, options.device_of_others);
  out.put(options.memory_of_others);
  put(out, options.scratch_of_others);
  return out.take();
}

void get_scan(ByteReader& in, FilteredScan& scan, FieldSups& sups, GoldSettings& settings) {
  scan.geometry = get_geometry(in);
  scan.views = get_struct<ViewMatrix>(in);
  scan.fft_length = in.get<std::int64_t>();
  scan.view_max = in.get_vector<double>();
  scan.ramp_error = in.get<double>();
  for (double* v :
       {&sups.value, &sups.second_u, &sups.second_v, &sups.sampled_second_u, &sups.sampled_second_v})
    *v = in.get<double>();
  sups.by_view = get_struct<DetectorSups>(in);
  settings = get_settings(in);
}

void put_kind(ByteWriter& out, const Crew::Kind& kind) {
  const DeviceInfo& d = kind.info;
  for (const std::string* text : {&d.platform, &d.name, &d.vendor, &d.version, &d.driver}) put(out, *text);
  for (const bool flag : {d.is_gpu, d.is_cpu, d.subnormals, d.images, d.linear_float_image,
                          d.linear_u16_image, d.linear_u8_image})
    out.put(static_cast<std::uint8_t>(flag));
  for (const std::uint64_t n : {d.image3d_max[0], d.image3d_max[1], d.image3d_max[2]}) out.put(n);
  put(out, static_cast<const FilterProbe&>(kind.probe));
  put(out, kind.probe.u16);
  put(out, kind.probe.u8);
  out.put(kind.arithmetic);
}

Crew::Kind get_kind(ByteReader& in) {
  Crew::Kind kind;
  DeviceInfo& d = kind.info;
  for (std::string* text : {&d.platform, &d.name, &d.vendor, &d.version, &d.driver}) *text = get_text(in);
  for (bool* flag : {&d.is_gpu, &d.is_cpu, &d.subnormals, &d.images, &d.linear_float_image,
                     &d.linear_u16_image, &d.linear_u8_image})
    *flag = in.get<std::uint8_t>() != 0;
  for (std::uint64_t& n : d.image3d_max) n = in.get<std::uint64_t>();
  get(in, static_cast<FilterProbe&>(kind.probe));
  get(in, kind.probe.u16);
  get(in, kind.probe.u8);
  kind.arithmetic = in.get<double>();
  return kind;
}

void put_pass(ByteWriter& out, const BlockPass& pass) {
  out.put(static_cast<std::uint8_t>(pass.ask));
  out.put(static_cast<std::uint8_t>(pass.fine));
  out.put(static_cast<std::uint8_t>(pass.purpose));
  out.put(pass.number);
  out.put(pass.tolerance.of_all);
  out.put(pass.tolerance.by_brick);
  put(out, pass.lattice);
  out.put(pass.selected);
  out.put(pass.level);
}

BlockPass get_pass(ByteReader& in) {
  BlockPass pass;
  pass.ask = static_cast<BlockPass::Ask>(in.get<std::uint8_t>());
  pass.fine = in.get<std::uint8_t>() != 0;
  pass.purpose = static_cast<GoldStream::For>(in.get<std::uint8_t>());
  pass.number = in.get<std::int64_t>();
  pass.tolerance.of_all = in.get<double>();
  pass.tolerance.by_brick = in.get_vector<float>();
  pass.lattice = get_lattice(in);
  pass.selected = in.get_vector<std::uint8_t>();
  pass.level = in.get_vector<LevelTriple>();
  return pass;
}

void put_records(ByteWriter& out, const std::vector<Bytes>& records) {
  out.put(static_cast<std::uint64_t>(records.size()));
  for (const Bytes& record : records) out.put(record);
}

std::vector<Bytes> get_records(ByteReader& in) {
  std::vector<Bytes> records(in.get<std::uint64_t>());
  for (Bytes& record : records) record = in.get_vector<std::byte>();
  return records;
}

void put_works(ByteWriter& out, const Works& works) {
  out.put(static_cast<std::uint64_t>(works.size()));
  for (const GoldStream::Work& w : works) {
    for (const std::int64_t n : {w.z, w.height, w.width_x, w.width_y}) out.put(n);
    out.put(w.first);
  }
}

Works get_works(ByteReader& in) {
  Works works(in.get<std::uint64_t>());
  for (GoldStream::Work& w : works) {
    for (std::int64_t* n : {&w.z, &w.height, &w.width_x, &w.width_y}) *n = in.get<std::int64_t>();
    w.first = in.get_vector<std::array<std::int64_t, 2>>();
  }
  return works;
}

void put_shape(ByteWriter& out, const MixedVolume& v) {
  put(out, v.grid);
  out.put(v.granularity);
  out.put(v.rate);
  out.put(v.coarsening);
  out.put(v.level);
  out.put(v.tile);
  out.put(v.step);
  put_shape(out, v.base);
  out.put(static_cast<std::uint64_t>(v.tiles.size()));
  for (const auto& [kind, block] : v.tiles) {
    out.put(kind.level);
    out.put(kind.part);
    put_shape(out, block);
  }
}

MixedVolume get_shape(ByteReader& in, const MemoryBudget& budget) {
  MixedVolume v;
  v.grid = get_grid(in);
  v.granularity = in.get<int>();
  v.rate = in.get<int>();
  v.coarsening = in.get<LevelTriple>();
  v.level = in.get_vector<LevelTriple>();
  v.tile = in.get_vector<std::uint32_t>();
  v.step = in.get<double>();
  v.base = get_block(in, budget);
  const auto kinds = in.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < kinds; ++i) {
    const auto level = in.get<LevelTriple>();
    const auto part = in.get<std::uint8_t>();
    v.tiles.emplace(TileKind(level, part), get_block(in, budget));
  }
  return v;
}

std::vector<std::span<const std::byte>> samples_of(const MixedVolume& volume) {
  std::vector<std::span<const std::byte>> out;
  for_each_block(volume, [&](const SampleBlock& b) {
    out.emplace_back(static_cast<const std::byte*>(b.data()), b.bytes());
  });
  return out;
}

std::vector<std::span<std::byte>> samples_to(MixedVolume& volume) {
  std::vector<std::span<std::byte>> out;
  for_each_block(volume, [&](SampleBlock& b) {
    void* first = b.type == SampleType::f32   ? static_cast<void*>(b.f32.data())
                  : b.type == SampleType::u16 ? static_cast<void*>(b.u16.data())
                                              : b.u8.data();
    out.emplace_back(static_cast<std::byte*>(first), b.bytes());
  });
  return out;
}

}  // namespace vdvr
