// Chooses and opens OpenCL devices, and keeps the account of allocations.
#include "vdvr/device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cctype>
#include <charconv>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include "host/base/opencl/device_end.hpp"
#include "host/base/opencl/state.hpp"
#include "host/base/opencl/trust.hpp"
#include "host/base/system/limits.hpp"
#include "host/base/system/lower.hpp"
#include "vdvr/error.hpp"

namespace vdvr {
namespace opencl {
namespace {

using Forget = void (*)(const State&) noexcept;
constinit std::array<std::atomic<Forget>, 4> listeners{};

void end(const State& state) noexcept {
  for (const auto& listener : listeners)
    if (const Forget forget = listener.load()) forget(state);
}

}  // namespace

void before_device_ends(Forget forget) {
  for (auto& listener : listeners) {
    Forget none = nullptr;
    if (listener.compare_exchange_strong(none, forget)) return;
  }
  throw std::logic_error("before_device_ends: no room for another cache");
}

namespace {

std::string lacking(std::uint64_t bytes, const std::string& what, std::uint64_t room, std::uint64_t limit) {
  const auto mebi = [](std::uint64_t n) { return static_cast<double>(n) / (1 << 20); };
  return fmt::format("{} needs {:.1f} MiB, but only {:.1f} of {:.1f} MiB are left", what, mebi(bytes),
                     mebi(room), mebi(limit));
}

}  // namespace

void MemoryAccount::set_limits(std::uint64_t of_host, std::uint64_t of_device, bool shared) {
  const std::lock_guard guard(lock_);
  host_.limit = of_host;
  device_.limit = of_device;
  shared_ = shared;
}

void MemoryAccount::Side::take(std::uint64_t bytes, const std::string& what, std::uint64_t kept,
                               const char* where) {
  if (bytes > room())
    throw ResourceError(lacking(bytes, what, room(), limit) + where +
                        "; raise `max_memory`, or choose a smaller `size`");
  used += bytes;
  peak = std::max(peak, used + kept);
}

MemoryAccount::Side& MemoryAccount::device_side() { return shared_ ? host_ : device_; }
const MemoryAccount::Side& MemoryAccount::device_side() const { return shared_ ? host_ : device_; }

void MemoryAccount::take(std::uint64_t bytes, const std::string& what, std::uint64_t kept) {
  const std::lock_guard guard(lock_);
  device_side().take(bytes, what, kept, shared_ ? "" : " on the device");
}

void MemoryAccount::take_host(std::uint64_t bytes, const std::string& what, std::uint64_t kept) {
  const std::lock_guard guard(lock_);
  host_.take(bytes, what, shared_ ? kept : 0, "");
}

void MemoryAccount::give(std::uint64_t bytes) noexcept {
  const std::lock_guard guard(lock_);
  device_side().used -= bytes;
}

void MemoryAccount::give_host(std::uint64_t bytes) noexcept {
  const std::lock_guard guard(lock_);
  host_.used -= bytes;
}

std::uint64_t MemoryAccount::peak() const {
  const std::lock_guard guard(lock_);
  return shared_ ? host_.peak : host_.peak + device_.peak;
}

std::uint64_t MemoryAccount::peak_of_one() const {
  const std::lock_guard guard(lock_);
  return std::max(host_.peak, device_.peak);
}

std::uint64_t MemoryAccount::left() const {
  const std::lock_guard guard(lock_);
  return device_side().room();
}

std::uint64_t MemoryAccount::host_left() const {
  const std::lock_guard guard(lock_);
  return host_.room();
}

std::uint64_t MemoryAccount::limit() const {
  const std::lock_guard guard(lock_);
  return host_.limit;
}

namespace {

// Small buffers come in sizes that many share: an allocation of one's own costs as much as a small kernel.
constexpr std::uint64_t large_buffer = std::uint64_t{1} << 20;
std::uint64_t pooled_size(std::uint64_t bytes) {
  return bytes >= large_buffer ? bytes : std::bit_ceil(std::max<std::uint64_t>(bytes, 256));
}
// Of a handful of large ones, and of the small ones together, the pool keeps no more.
constexpr std::size_t most_large = 12;
constexpr std::uint64_t most_small_bytes = std::uint64_t{32} << 20;

}  // namespace

cl::Buffer BufferPool::take(std::uint64_t bytes) {
  bytes = pooled_size(bytes);
  const auto found = buffers_.find(bytes);
  if (found == buffers_.end()) return {};
  cl::Buffer buffer = std::move(found->second);
  buffers_.erase(found);
  bytes_ -= bytes;
  return buffer;
}

void BufferPool::keep(std::uint64_t bytes, cl::Buffer buffer) {
  bytes = pooled_size(bytes);
  const auto large = buffers_.lower_bound(large_buffer);
  if (bytes >= large_buffer) {
    if (static_cast<std::size_t>(std::distance(large, buffers_.end())) >= most_large) clear();
  } else {
    std::uint64_t small = bytes;
    for (auto b = buffers_.begin(); b != large; ++b) small += b->first;
    if (small > most_small_bytes) clear();
  }
  buffers_.emplace(bytes, std::move(buffer));
  bytes_ += bytes;
}

void BufferPool::clear() {
  buffers_.clear();
  bytes_ = 0;
}

namespace {

std::atomic<int> open_states{0};

}  // namespace

State::State() : memory(own_memory_), main_(*this) { ++open_states; }

State::State(State* main)
    : info(main->info),
      device(main->device),
      context(main->context),
      queue(context, device, CL_QUEUE_PROFILING_ENABLE),
      memory(main->memory),
      kernels(main->kernels),
      longest_launch(main->longest_launch),
      main_(*main) {}

State::~State() {
  strands_.clear();
  // Kernels may still run, and writes read what is staged.
  if (queue() != nullptr) clFinish(queue());
  if (&main_ == this) --open_states;
}

State& State::strand(std::size_t number) {
  const std::lock_guard guard(pool_lock_);
  try {
    while (strands_.size() <= number) strands_.push_back(std::make_unique<State>(this));
  } catch (const cl::Error& e) {
    throw DeviceError(fmt::format("another queue on '{}': {}", info.name, code_name(e.err())));
  }
  return *strands_[number];
}

// A card hides the host's work behind others' kernels, a CPU the ends of launches too, where its threads run
// dry. PoCL's devices without threads ("basic") wait for other queues with locks held. Its others,
// before 6.0, count the users of a kernel for one size down for another size that was launched after it, and
// abort at 0 (pocl_release_dlhandle_cache). 3.1 counts each twice up, so that two may run, of all devices.
// Later ones have not been tried.
int State::most_strands() const {
  if (info.platform != pocl_platform) return info.is_cpu ? 2 : 4;
  if (!info.name.starts_with("pthread")) return 1;
  double version = 0;
  std::from_chars(info.driver.data(), info.driver.data() + info.driver.size(), version);
  return version == 3.1 && open_states == 1 ? 2 : 1;
}

void State::wait_for(State& other) {
  try {
    cl::Event so_far;
    other.queue.enqueueMarkerWithWaitList(nullptr, &so_far);
    other.queue.flush();
    const std::vector<cl::Event> events{so_far};
    queue.enqueueBarrierWithWaitList(&events);
  } catch (const cl::Error& e) {
    throw DeviceError(fmt::format("waiting for another queue of '{}': {}", info.name, code_name(e.err())));
  }
}

std::uint64_t State::kept_bytes() const {
  std::uint64_t bytes = pool_.bytes();
  for (const auto& strand : strands_) bytes += strand->pool_.bytes();
  return bytes;
}

void State::clear_pools() {
  pool_.clear();
  for (const auto& strand : strands_) strand->pool_.clear();
}

cl::Buffer State::allocate(std::uint64_t bytes, const std::string& what) {
  if (bytes > info.max_allocation) {
    throw ResourceError(fmt::format(
        "{}: {} bytes in one buffer, but '{}' allows {}; choose a smaller `size` or another `device`", what,
        bytes, info.name, info.max_allocation));
  }
  const std::uint64_t size = pooled_size(bytes);
  const std::lock_guard guard(main_.pool_lock_);
  cl::Buffer buffer = pool_.take(bytes);
  // What pools keep is in use as well: it goes first when room is short.
  if (memory.left() < size + main_.kept_bytes()) main_.clear_pools();
  memory.take(size, what, main_.kept_bytes());
  if (buffer() != nullptr) return buffer;
  try {
    return cl::Buffer(context, CL_MEM_READ_WRITE, size);
  } catch (const cl::Error& e) {
    memory.give(size);
    throw ResourceError(
        fmt::format("{}: '{}' refused {} bytes: {}", what, info.name, bytes, code_name(e.err())));
  }
}

void State::release(std::uint64_t bytes, cl::Buffer buffer) noexcept {
  memory.give(pooled_size(bytes));
  try {
    const std::lock_guard guard(main_.pool_lock_);
    pool_.keep(bytes, std::move(buffer));
  } catch (...) {  // no memory for the pool's own entry: the buffer is simply freed
  }
}

void State::take_host(std::uint64_t bytes, const std::string& what) {
  const std::lock_guard guard(main_.pool_lock_);
  if (memory.host_left() < bytes + main_.kept_bytes()) main_.clear_pools();
  memory.take_host(bytes, what, main_.kept_bytes());
}

}  // namespace opencl

namespace {

struct FoundDevice {
  cl::Device device;
  DeviceInfo info;
  std::string trouble;  // a call that failed; empty where none did
};

std::string trimmed(std::string s) {
  while (!s.empty() && (s.back() == '\0' || std::isspace(static_cast<unsigned char>(s.back())))) s.pop_back();
  return s;
}

std::string trouble_of(const cl::Error& e) {
  return fmt::format("{}: {}", e.what(), opencl::code_name(e.err()));
}

// What is known before a call fails stays.
void describe(const cl::Device& device, DeviceInfo& d) {
  d.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
  d.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
  d.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
  d.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
  const cl_device_type type = device.getInfo<CL_DEVICE_TYPE>();
  d.is_gpu = (type & CL_DEVICE_TYPE_GPU) != 0;
  d.is_cpu = (type & CL_DEVICE_TYPE_CPU) != 0;
  d.global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  d.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  d.local_memory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
  d.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  d.max_work_group = static_cast<std::uint32_t>(device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>());
  d.subnormals = (device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_DENORM) != 0;
  d.images = device.getInfo<CL_DEVICE_IMAGE_SUPPORT>() == CL_TRUE;
  if (d.images) {
    d.image3d_max[0] = device.getInfo<CL_DEVICE_IMAGE3D_MAX_WIDTH>();
    d.image3d_max[1] = device.getInfo<CL_DEVICE_IMAGE3D_MAX_HEIGHT>();
    d.image3d_max[2] = device.getInfo<CL_DEVICE_IMAGE3D_MAX_DEPTH>();
  }
}

std::vector<cl::Device> devices_of(const cl::Platform& platform) {
  std::vector<cl::Device> devices;
  try {
    platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
  } catch (const cl::Error& e) {
    if (e.err() != CL_DEVICE_NOT_FOUND) throw;
  }
  return devices;
}

// All devices of all platforms, in a stable order: places are `--device` numbers, so that whoever cannot be
// used keeps one. A platform whose devices cannot be asked for has one place.
std::vector<FoundDevice> find_devices() {
  std::vector<FoundDevice> found;
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return found;  // the loader reports "no platform" as an error
  }
  for (const auto& platform : platforms) {
    DeviceInfo info;
    info.index = static_cast<int>(found.size());
    std::vector<cl::Device> devices;
    try {
      info.platform = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
      devices = devices_of(platform);
    } catch (const cl::Error& e) {
      info.name = "a platform without devices";
      found.push_back({{}, info, trouble_of(e)});
      continue;
    }
    for (const auto& device : devices) {
      FoundDevice one{{}, info, ""};
      DeviceInfo& d = one.info;
      d.index = static_cast<int>(found.size());
      try {
        one.device = device;
        if (device.getInfo<CL_DEVICE_AVAILABLE>() != CL_TRUE) continue;
        describe(device, d);
      } catch (const cl::Error& e) {
        one.trouble = trouble_of(e);
        if (d.name.empty()) d.name = "a device without a name";
      }
      found.push_back(std::move(one));
    }
  }
  return found;
}

// Which 3D images can be read with the linear filter. Opens a context of its own.
void ask_image_formats(FoundDevice& found) {
  DeviceInfo& d = found.info;
  if (!d.images || !found.trouble.empty()) return;
  try {
    const cl::Context context(found.device);
    std::vector<cl::ImageFormat> formats;
    context.getSupportedImageFormats(CL_MEM_READ_ONLY, CL_MEM_OBJECT_IMAGE3D, &formats);
    const auto has = [&](cl_channel_type type) {
      return std::any_of(formats.begin(), formats.end(), [&](const cl::ImageFormat& f) {
        return f.image_channel_order == CL_R && f.image_channel_data_type == type;
      });
    };
    d.linear_float_image = has(CL_FLOAT);
    d.linear_u16_image = has(CL_UNORM_INT16);
    d.linear_u8_image = has(CL_UNORM_INT8);
  } catch (const cl::Error& e) {
    found.trouble = trouble_of(e);
  }
}

bool matches(const DeviceInfo& d, const std::string& selector) {
  if (selector == "cpu") return d.is_cpu;
  if (selector == "gpu") return d.is_gpu;
  if (!selector.empty() &&
      std::all_of(selector.begin(), selector.end(), [](unsigned char c) { return std::isdigit(c); }))
    return selector == std::to_string(d.index);
  return lower(d.name).find(lower(selector)) != std::string::npos ||
         lower(d.platform).find(lower(selector)) != std::string::npos;
}

}  // namespace

std::vector<ListedDevice> describe_devices() {
  std::vector<ListedDevice> listed;
  for (FoundDevice& found : find_devices()) {
    ask_image_formats(found);
    listed.push_back({found.info, found.trouble});
  }
  return listed;
}

std::vector<DeviceInfo> Device::list() {
  std::vector<DeviceInfo> infos;
  for (const ListedDevice& listed : describe_devices())
    if (listed.trouble.empty()) infos.push_back(listed.info);
  return infos;
}

namespace {

// Those that the selector means, the best first. Not copies: each would be an OpenCL call, which may fail.
std::vector<const FoundDevice*> chosen_from(const std::vector<FoundDevice>& all,
                                            const std::string& selector) {
  std::vector<const FoundDevice*> chosen;
  for (const FoundDevice& found : all)
    if (selector.empty() || matches(found.info, selector)) chosen.push_back(&found);
  if (selector.empty())
    std::stable_partition(chosen.begin(), chosen.end(), [](const FoundDevice* f) { return f->info.is_gpu; });
  return chosen;
}

bool shares_host_memory(const opencl::State& state) {
  if (state.info.is_cpu) return true;
  try {
    return state.device.getInfo<CL_DEVICE_HOST_UNIFIED_MEMORY>() == CL_TRUE;
  } catch (const cl::Error&) {
    return false;  // then its memory is counted by itself, and the host's as well
  }
}

// Throws DeviceError, BuildError or ResourceError where the device cannot be used.
std::shared_ptr<opencl::State> opened(const FoundDevice& listed) {
  auto state = std::make_shared<opencl::State>();
  DeviceTest test;
  FoundDevice found{{}, listed.info, listed.trouble};
  try {
    found.device = listed.device;
    ask_image_formats(found);
    if (!found.trouble.empty())
      throw DeviceError(fmt::format("device {}, '{}', cannot be used: {}; choose another `device`",
                                    found.info.index, found.info.name, found.trouble));
    state->device = found.device;
    state->info = found.info;
    if (state->info.is_cpu) state->longest_launch = 2;
    state->context = cl::Context(state->device);
    state->queue = cl::CommandQueue(state->context, state->device, CL_QUEUE_PROFILING_ENABLE);
    test = opencl::test_device(*state);
  } catch (const cl::Error& e) {
    throw DeviceError(
        fmt::format("cannot open '{}': {} {}", found.info.name, e.what(), opencl::code_name(e.err())));
  }
  if (!test.passed() && !opencl::untrusted_are_opened())
    throw DeviceError(fmt::format(
        "'{}' (driver {}) does not compute as certificates assume: {}; choose another `device`, or "
        "draw with `untrusted_device`",
        found.info.name, found.info.driver, test.failures()));
  if (!test.passed()) opencl::tell(fmt::format("'{}' is not trusted: {}", found.info.name, test.failures()));
  opencl::keep_test(*state, std::move(test));
  return state;
}

}  // namespace

Device::Device(const std::string& selector, std::uint64_t max_memory_bytes) {
  const std::vector<FoundDevice> all = find_devices();
  if (all.empty())
    throw DeviceError("no OpenCL device found; install one, for a CPU the package pocl-opencl-icd");
  const std::vector<const FoundDevice*> chosen = chosen_from(all, selector);
  if (chosen.empty()) {
    std::string names;
    for (const FoundDevice& found : all)
      names += fmt::format("\n  {}: {} ({})", found.info.index, found.info.name, found.info.platform);
    throw DeviceError(fmt::format("no device matches `device` '{}'; there are:{}", selector, names));
  }
  std::vector<std::string> passed_over;
  for (const FoundDevice* found : chosen) {
    try {
      state_ = opened(*found);
      break;
    } catch (const Error& e) {
      const bool of_device =
          e.kind() == ErrorKind::device || e.kind() == ErrorKind::build || e.kind() == ErrorKind::resource;
      if (!of_device || chosen.size() == 1) throw;
      passed_over.emplace_back(e.what());
    }
  }
  if (!state_) {
    std::string reasons;
    for (const std::string& reason : passed_over) reasons += "\n  " + reason;
    throw DeviceError(fmt::format("no device that `device` '{}' means can be used:{}", selector, reasons));
  }
  for (const std::string& reason : passed_over)
    opencl::tell(fmt::format("{}; going on with '{}'", reason, state_->info.name));
  // The test's own buffers are gone, and count for nothing.
  // On a card others have memory too: drivers, displays.
  const std::uint64_t device_memory = state_->info.global_memory;
  const bool shared = shares_host_memory(*state_);
  const std::uint64_t most = shared ? device_memory : io::physical_memory();
  const std::uint64_t asked = max_memory_bytes == 0 ? UINT64_MAX : max_memory_bytes;
  state_->memory.set_limits(std::min(asked, most), std::min(asked, device_memory / 10 * 9), shared);
}

Device::~Device() {
  if (state_) opencl::end(*state_);
}
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&& other) noexcept {
  if (this != &other) {
    if (state_) opencl::end(*state_);
    state_ = std::move(other.state_);
  }
  return *this;
}

const DeviceInfo& Device::info() const { return state_->info; }
std::uint64_t Device::memory_left() const { return state_->memory.left(); }
std::uint64_t Device::peak_memory() const { return state_->memory.peak(); }

}  // namespace vdvr
