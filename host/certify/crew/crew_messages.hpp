// What processes of a crew say to one another, as bytes and back: the scan, passes, fields, pieces of work.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host/certify/crew/crew.hpp"

namespace vdvr {

enum class CrewWord : std::uint8_t {
  wake,   // leader: the device that will be opened; no answer
  warm,   // leader: a program that it has built; no answer
  open,   // leader: the device to open; answer: hello
  hello,  // what it is
  scan,   // leader: a new build; answer: ready
  ready,
  field,   // leader: the shape of a field, whose samples follow
  part,    // leader: some of these samples
  learn,   // leader: records of what all need
  pass,    // leader
  work,    // leader: a piece of the pass
  halt,    // leader: what was given and not begun is not wanted any more
  record,  // of a piece
  done,    // the piece
  alive,
  failed,  // why
  dismiss  // leader: nothing more will come
};

/// Samples of a field on their way, so many bytes at a time.
constexpr std::uint64_t part_bytes = std::uint64_t{8} << 20;

void put(ByteWriter& out, const std::string& text);
std::string get_text(ByteReader& in);
void put(ByteWriter& out, CrewWord word);

/// `wake` or `open`.
Bytes message_to_open(CrewWord word, const CrewOptions& options);

void put_scan(ByteWriter& out, const FilteredScan& scan, const FieldSups& sups, const GoldSettings& settings);
/// Without the samples.
void get_scan(ByteReader& in, FilteredScan& scan, FieldSups& sups, GoldSettings& settings);

void put_kind(ByteWriter& out, const Crew::Kind& kind);
Crew::Kind get_kind(ByteReader& in);

void put_pass(ByteWriter& out, const BlockPass& pass);
BlockPass get_pass(ByteReader& in);

void put_records(ByteWriter& out, const std::vector<Bytes>& records);
std::vector<Bytes> get_records(ByteReader& in);

void put_works(ByteWriter& out, const Works& works);
Works get_works(ByteReader& in);

/// A volume without its samples, and where these lie.
void put_shape(ByteWriter& out, const MixedVolume& volume);
MixedVolume get_shape(ByteReader& in, const MemoryBudget& budget);
/// All of them in one order.
std::vector<std::span<const std::byte>> samples_of(const MixedVolume& volume);
std::vector<std::span<std::byte>> samples_to(MixedVolume& volume);

}  // namespace vdvr
