// The seal of a file.
#define BOOST_TEST_MODULE seal
#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/support/program.hpp"
#include "tests/support/vdvr_files.hpp"

using namespace vdvr;
using Json = nlohmann::ordered_json;

namespace {

/// A certificate with a total for every brick, so that a file has everything it can have.
Certificate with_totals(const MixedVolume& v) {
  Certificate c = support::full_certificate();
  c.brick_totals.assign(v.level.size(), 0.25f);
  c.brick_totals[1] = -1;
  return c;
}

std::filesystem::path write_sealed(const support::Folder& folder, bool integers = false) {
  MixedVolume v = support::small_volume();
  if (integers) v = support::in_types(v, {SampleType::u16, SampleType::u8, SampleType::u16});
  write_vdvr(folder.path / "a.vdvr", v, with_totals(v));
  return folder.path / "a.vdvr";
}

void edit(const std::filesystem::path& path, const support::Edit& change) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  BOOST_REQUIRE(file >= 0);
  change(file);
  BOOST_REQUIRE(H5Fclose(file) >= 0);
}

/// Refused, be it as altered or because it makes no sense any more; and where it still reads, as altered.
bool is_refused(const std::filesystem::path& path) {
  try {
    static_cast<void>(read_vdvr(path));
  } catch (const MismatchError&) {
    return !read_vdvr(path, 0, Altered::report).altered.empty();
  } catch (const FileError&) {
    return true;
  }
  return false;
}

support::Edit remove_attribute(const std::string& object, const std::string& name) {
  return [=](hid_t file) {
    BOOST_REQUIRE(H5Adelete_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT) >= 0);
  };
}

support::Edit set_text(const std::string& object, const std::string& name, const std::string& text) {
  return [=](hid_t file) {
    H5Adelete_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT);
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, text.size());
    const hid_t attribute = H5Acreate_by_name(file, object.c_str(), name.c_str(), type, space, H5P_DEFAULT,
                                              H5P_DEFAULT, H5P_DEFAULT);
    BOOST_REQUIRE(H5Awrite(attribute, type, text.data()) >= 0);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
  };
}

/// Every member of the JSON, leaves and what holds them, as pointers.
void members(const Json& value, const Json::json_pointer& at, std::vector<Json::json_pointer>& all) {
  if (!at.empty()) all.push_back(at);
  if (value.is_object())
    for (const auto& [name, child] : value.items()) members(child, at / name, all);
  if (value.is_array())
    for (std::size_t i = 0; i < value.size(); ++i) members(value[i], at / i, all);
}

/// The same kind of value, but another.
Json other(const Json& value) {
  if (value.is_boolean()) return !value.get<bool>();
  if (value.is_number_integer()) return value.get<std::int64_t>() + 1;
  if (value.is_number()) {
    const double x = value.get<double>();
    return x == 0 ? 1e-3 : std::nextafter(x, 0.0);
  }
  if (value.is_string()) return value.get<std::string>() + "x";
  if (value.is_null()) return Json::array({0.5, 0.75});
  Json more = value;
  if (value.is_array()) more.push_back(1);
  else more["more"] = 1;
  return more;
}

/// Elements of a dataset that the reader takes as they come, one of them changed by the least.
template <class T>
support::Edit nudge(const std::string& path, hid_t memory, std::size_t at) {
  return [=](hid_t file) {
    const hid_t dataset = H5Dopen2(file, path.c_str(), H5P_DEFAULT), space = H5Dget_space(dataset);
    std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
    BOOST_REQUIRE(H5Dread(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
    T& value = values[at % values.size()];
    if constexpr (std::is_floating_point_v<T>) value = std::nextafter(value, T{-2});
    else value = static_cast<T>(value ^ 1);
    BOOST_REQUIRE(H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0);
    H5Sclose(space);
    H5Dclose(dataset);
  };
}

std::vector<std::pair<std::string, std::string>> all_attributes(const std::filesystem::path& path) {
  std::vector<std::pair<std::string, std::string>> all;
  edit(path, [&](hid_t file) {
    for (const char* object : {"/", "/grid", "/base"}) {
      const hid_t id = H5Oopen(file, object, H5P_DEFAULT);
      std::vector<std::string> names;
      H5Aiterate2(
          id, H5_INDEX_NAME, H5_ITER_INC, nullptr,
          [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
            static_cast<std::vector<std::string>*>(out)->emplace_back(name);
            return 0;
          },
          &names);
      H5Oclose(id);
      for (const std::string& name : names) all.emplace_back(object, name);
    }
  });
  return all;
}

/// Changes what an attribute says by the least: a bit of a number, a letter of a text.
support::Edit nudge_attribute(const std::string& object, const std::string& name) {
  return [=](hid_t file) {
    hid_t a = H5Aopen_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    const hid_t type = H5Aget_type(a), space = H5Aget_space(a);
    std::vector<char> bytes(H5Tget_size(type) *
                            static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
    BOOST_REQUIRE(H5Aread(a, type, bytes.data()) >= 0);
    H5Aclose(a);
    bytes.front() = static_cast<char>(bytes.front() ^ 1);
    H5Adelete_by_name(file, object.c_str(), name.c_str(), H5P_DEFAULT);
    a = H5Acreate_by_name(file, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT,
                          H5P_DEFAULT);
    BOOST_REQUIRE(H5Awrite(a, type, bytes.data()) >= 0);
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(a);
  };
}

}  // namespace

// --- the seal ---

BOOST_AUTO_TEST_CASE(what_was_written_is_sealed) {
  const support::Folder folder;
  for (const bool integers : {false, true}) {
    const VdvrFile file = read_vdvr(write_sealed(folder, integers));
    BOOST_TEST((file.seal == Seal::whole));
    BOOST_TEST(file.altered.empty());
    BOOST_TEST(file.certificate.sealed);
  }
}

BOOST_AUTO_TEST_CASE(every_edit_of_a_member_of_the_certificate_breaks_the_seal) {
  const support::Folder folder;
  const auto path = write_sealed(folder);
  const Json json = Json::parse(read_vdvr(path).certificate_json);
  std::vector<Json::json_pointer> all;
  members(json, Json::json_pointer(), all);
  BOOST_TEST(all.size() > 80u);
  for (const auto& member : all) {
    Json changed = json;
    changed[member] = other(json[member]);
    edit(path, support::set_certificate(changed.dump(2)));
    BOOST_TEST(is_refused(path), member.to_string() << " changed");
    Json without = json;
    Json& holder = without[member.parent_pointer()];
    if (holder.is_array()) holder.erase(Json::size_type{std::stoul(member.back())});
    else holder.erase(member.back());
    edit(path, support::set_certificate(without.dump(2)));
    BOOST_TEST(is_refused(path), member.to_string() << " taken out");
  }
  // Said with other spaces it is another text; put back, the seal is whole, be the text of variable length.
  edit(path, support::set_certificate(json.dump(1)));
  BOOST_TEST(is_refused(path));
  edit(path, support::set_certificate(json.dump(2, ' ', false, Json::error_handler_t::replace)));
  BOOST_TEST((read_vdvr(path).seal == Seal::whole));
}

BOOST_AUTO_TEST_CASE(every_edit_of_an_attribute_breaks_the_seal) {
  const support::Folder folder;
  for (const bool integers : {false, true}) {
    const auto path = write_sealed(folder, integers);
    const std::string bytes = support::bytes_of(path);
    const auto all = all_attributes(path);
    BOOST_TEST(all.size() == (integers ? 13u : 10u));
    for (const auto& [object, name] : all) {
      support::put(path, bytes);
      edit(path, nudge_attribute(object, name));
      BOOST_TEST(is_refused(path), object << " " << name << " changed");
      support::put(path, bytes);
      edit(path, remove_attribute(object, name));
      BOOST_TEST(is_refused(path), object << " " << name << " taken out");
    }
    for (const char* object : {"/", "/grid", "/base", "/tiles", "/tile", "/certificate", "/brick_total"}) {
      support::put(path, bytes);
      edit(path, support::set_integer(object, "more", 1));
      BOOST_TEST(is_refused(path), "one more attribute of " << object);
    }
  }
}

BOOST_AUTO_TEST_CASE(every_change_of_an_array_is_refused) {
  const support::Folder folder;
  for (const bool integers : {false, true}) {
    const auto path = write_sealed(folder, integers);
    const std::string bytes = support::bytes_of(path);
    std::vector<std::string> names{"/base", "/level", "/tile", "/brick_total"};
    edit(path, [&](hid_t file) {
      const hid_t tiles = H5Gopen2(file, "/tiles", H5P_DEFAULT);
      H5Literate(
          tiles, H5_INDEX_NAME, H5_ITER_INC, nullptr,
          [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
            static_cast<std::vector<std::string>*>(out)->push_back(std::string("/tiles/") + name);
            return 0;
          },
          &names);
      H5Gclose(tiles);
    });
    for (const std::string& name : names)
      for (const std::size_t at : {0, 1, 5, 1001}) {
        support::put(path, bytes);
        edit(path, [&](hid_t file) {
          const hid_t dataset = H5Dopen2(file, name.c_str(), H5P_DEFAULT), type = H5Dget_type(dataset);
          const bool real = H5Tget_class(type) == H5T_FLOAT;
          H5Tclose(type);
          H5Dclose(dataset);
          if (real) nudge<float>(name, H5T_NATIVE_FLOAT, at)(file);
          else nudge<std::int32_t>(name, H5T_NATIVE_INT32, at)(file);
        });
        BOOST_TEST(is_refused(path), name << " " << at << (integers ? ", integers" : ""));
      }
    support::put(path, bytes);
    edit(path, [](hid_t file) { H5Ldelete(file, "/brick_total", H5P_DEFAULT); });
    BOOST_TEST(is_refused(path), "/brick_total taken out");
  }
}

BOOST_AUTO_TEST_CASE(a_seal_that_is_taken_out_or_changed_is_missed) {
  const support::Folder folder;
  const auto path = write_sealed(folder);
  const std::string bytes = support::bytes_of(path), seal = [&] {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT),
                a = H5Aopen_by_name(file, "/", "seal", H5P_DEFAULT, H5P_DEFAULT), type = H5Aget_type(a);
    std::string text(H5Tget_size(type), '\0');
    H5Aread(a, type, text.data());
    H5Tclose(type);
    H5Aclose(a);
    H5Fclose(file);
    return text;
  }();
  BOOST_TEST(seal.size() == 64u);
  edit(path, remove_attribute("/", "seal"));
  const VdvrFile without = read_vdvr(path, 0, Altered::report);
  BOOST_TEST((without.seal == Seal::broken));
  BOOST_TEST(without.altered.find("the seal is gone") != std::string::npos, without.altered);
  edit(path, set_text("/", "seal", std::string(64, '0')));
  BOOST_TEST((read_vdvr(path, 0, Altered::report).seal == Seal::broken));
  edit(path, set_text("/", "seal", seal.substr(0, 63)));
  BOOST_TEST(is_refused(path));
  edit(path, set_text("/", "seal", seal));
  BOOST_TEST((read_vdvr(path).seal == Seal::whole));
}

BOOST_AUTO_TEST_CASE(files_of_earlier_programs_open_and_are_unsealed) {
  const support::Folder folder;
  const auto path = write_sealed(folder);
  Json json = Json::parse(read_vdvr(path).certificate_json);
  json.erase("sealed");
  edit(path, remove_attribute("/", "seal"));
  edit(path, support::set_certificate(json.dump(2)));
  const VdvrFile file = read_vdvr(path);
  BOOST_TEST((file.seal == Seal::none));
  BOOST_TEST(std::string(text_of(file.seal)) == "unsealed");
  BOOST_TEST(!file.certificate.sealed);
}

// --- the program ---

BOOST_AUTO_TEST_CASE(info_render_and_verify_refuse_what_was_edited) {
  const support::Folder folder;
  const support::Program program(folder.path);
  const auto at = [&](const char* name) { return (folder.path / name).string(); };
  const auto run = [&](const std::vector<std::string>& words) { return program.run(words); };
  const std::string scan = at("sphere.h5"), volume = at("sphere.vdvr"), bad = at("bad.vdvr");
  BOOST_REQUIRE(
      run({"simulate", "--phantom", "sphere", "--detector", "21x7", "--angles", "24", "-o", scan}).code == 0);
  BOOST_REQUIRE(run({"build", scan, "--epsilon", "20%", "-o", volume}).code == 0);
  const std::string bytes = support::bytes_of(volume);
  const auto codes = [&] {
    return std::array{run({"info", bad}).code,
                      run({"render", bad, "--size", "16x16", "-o", at("p.png"), "--force"}).code,
                      run({"verify", bad, "--projections", scan}).code,
                      run({"export", bad, "-o", at("e.mha"), "--force"}).code};
  };
  const std::array all_refuse{1, 1, 1, 1}, none_refuses{0, 0, 0, 0};
  const auto said = [&] { return run({"info", bad}); };
  support::put(bad, bytes);
  BOOST_TEST(codes() == none_refuses);
  BOOST_TEST(said().out.find("sealed: ") != std::string::npos, said().out);

  const Json json = Json::parse(read_vdvr(volume).certificate_json);
  for (const char* member :
       {"/not_covered/count", "/options/geometry/center", "/budget/arithmetic/value", "/device"}) {
    Json changed = json;
    changed[Json::json_pointer(member)] = other(json[Json::json_pointer(member)]);
    support::put(bad, bytes);
    edit(bad, support::set_certificate(changed.dump(2)));
    BOOST_TEST(codes() == all_refuse, member);
    BOOST_TEST(said().out.find("BROKEN SEAL") != std::string::npos, said().out);
  }
  for (const support::Edit& change :
       {remove_attribute("/", "seal"), set_text("/", "generator", "another"),
        support::Edit([](hid_t file) { H5Ldelete(file, "/brick_total", H5P_DEFAULT); })}) {
    support::put(bad, bytes);
    edit(bad, change);
    BOOST_TEST(codes() == all_refuse);
  }
  BOOST_TEST(run({"render", bad, "--unverified", "--size", "16x16", "-o", at("p.png"), "--force"}).code == 0);

  // Without seal and member a file is one of an earlier program, and says so.
  Json plain = json;
  plain.erase("sealed");
  support::put(bad, bytes);
  edit(bad, remove_attribute("/", "seal"));
  edit(bad, support::set_certificate(plain.dump(2)));
  BOOST_TEST(codes() == none_refuses);
  BOOST_TEST(said().out.find("unsealed") != std::string::npos);
  BOOST_TEST(run({"render", bad, "--size", "16x16", "-o", at("p.png"), "--force"}).err.find("unsealed") !=
             std::string::npos);

  // Sealed again, only the projections tell.
  VdvrFile file = read_vdvr(volume);
  file.certificate.not_covered_count += 1;
  write_vdvr(bad, file.volume, file.certificate);
  BOOST_TEST((codes() == std::array{0, 0, 1, 0}));
}
