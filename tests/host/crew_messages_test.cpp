// What processes of a crew say comes back as it was, and journal records keep their bytes.
#define BOOST_TEST_MODULE crew_messages
#include "host/certify/crew/crew_messages.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>

#include "vdvr/error.hpp"

using namespace vdvr;

namespace {

template <class T>
Bytes bytes_of(const T& value) {
  ByteWriter out;
  out.put(value);
  return out.take();
}

// Read back; writing that gives the same bytes, and no byte may lack.
template <class T>
T again(const T& value) {
  const Bytes bytes = bytes_of(value);
  ByteReader in(bytes);
  T back = in.get<T>();
  BOOST_TEST(in.empty());
  BOOST_TEST((bytes_of(back) == bytes));
  ByteReader cut(std::span<const std::byte>(bytes).first(bytes.size() - 1));
  BOOST_CHECK_THROW(static_cast<void>(cut.get<T>()), FileError);
  return back;
}

}  // namespace

BOOST_AUTO_TEST_CASE(settings_and_passes_come_back) {
  GoldSettings s;
  s.grid = {{1, 2, 3}, {0.5, -1, 2}, {1, 2, 3}, "mm"};
  s.window = {-1, 2};
  s.midrange = s.grid_only = true;
  s.coarsening = {1, 2, 3};
  s.interpolation = Interpolation::six_taps;
  s.least_reach = 3;
  const GoldSettings t = again(s);
  BOOST_TEST((t.grid.cells == s.grid.cells && t.grid.origin == s.grid.origin && t.grid.unit == "mm"));
  BOOST_TEST((t.window == s.window && t.coarsening == s.coarsening && t.interpolation == s.interpolation));
  BOOST_TEST((t.midrange && t.grid_only && !t.anisotropic && !t.base_only && t.least_reach == 3));
  s.window.reset();
  BOOST_TEST(!again(s).window);

  BlockPass p;
  p.ask = BlockPass::Ask::extract;
  p.fine = false;
  p.rate = 32;
  p.purpose = GoldStream::For::proposing;
  p.number = 9;
  p.tolerance = NodeTolerance(0.1, {0.5F, 0.25F});
  p.lattice.least = SampleType::u8;
  p.selected = {1, 0, 1};
  p.level = {{1, 2, 3}};
  p.cells = {{{1, 2, 3}, {4, 5, 6}}};
  const BlockPass q = again(p);
  BOOST_TEST((q.ask == p.ask && !q.fine && q.rate == 32 && q.purpose == p.purpose && q.number == 9));
  BOOST_TEST((q.tolerance.of_all == 0.1 && q.tolerance.by_brick == p.tolerance.by_brick));
  BOOST_TEST((q.lattice.least == SampleType::u8 && q.selected == p.selected && q.level == p.level &&
              q.cells == p.cells));
}

BOOST_AUTO_TEST_CASE(devices_scans_and_works_come_back) {
  Crew::Kind kind;
  kind.info.name = "a device";
  kind.info.is_cpu = true;
  kind.info.image3d_max[1] = 5;
  kind.probe.u8.by_steps[3] = 2;
  kind.arithmetic = 0.25;
  const Crew::Kind k = again(kind);
  BOOST_TEST((k.info.name == "a device" && k.info.is_cpu && !k.info.is_gpu && k.info.image3d_max[1] == 5));
  BOOST_TEST((k.probe.u8.by_steps[3] == 2 && k.arithmetic == 0.25));

  FieldSups sups;
  sups.by_view.resize(2);
  sups.by_view[1].fourth_v = 3;
  const FieldSups found = again(sups);
  BOOST_TEST((found.by_view[1].fourth_v == 3 && std::isinf(found.by_view[0].fourth_u)));

  const Works works = again(Works{{1, 2, 3, 4, {{5, 6}}}, {7, 8, 9, 10, {}}});
  BOOST_TEST((works.size() == 2 && works[0].first[0][1] == 6 && works[1].width_y == 10));
  const std::vector<Bytes> records{Bytes(3, std::byte{1}), {}, Bytes(1)};
  BOOST_TEST((again(records) == records));
}

BOOST_AUTO_TEST_CASE(messages_begin_with_their_word) {
  const Bytes message = message_of(CrewWord::warm, std::string("kernel"), opencl::Defines{{"a", "b"}});
  BOOST_TEST((message.front() == static_cast<std::byte>(CrewWord::warm)));
  ByteReader in(message);
  CrewWord word{};
  std::string name;
  opencl::Defines defines;
  in(word, name, defines);
  BOOST_TEST((in.empty() && name == "kernel" && defines.size() == 1 && defines[0].second == "b"));
}

// Journals of earlier builds are read: these sizes are those of their records.
BOOST_AUTO_TEST_CASE(records_of_journals_keep_their_bytes) {
  BOOST_TEST(bytes_of(BrickMeasure{}).size() == 8u + 6 * 4 + 6 * 2);
  BOOST_TEST(bytes_of(BlockKey{4, 1, 2, {3, 4, 5}, {{6, 7}}}).size() == 6u * 8 + 8 + 2 * 8);
  BOOST_TEST(bytes_of(AxisErrors{}).size() == 3u * AxisErrors::most_levels * 2 * 4);
}
