// Two kernels that read nothing but what the host wrote: in two pieces, and by a fill. Under Oclgrind 21.10
// alone, with its check of uninitialised values, both are reported; with the layer of whole_writes.cpp
// neither is, which CTest checks (scripts/under-oclgrind build/tests/oclgrind_written_in_pieces).
#include <CL/opencl.hpp>
#include <cstdio>
#include <vector>

namespace {

constexpr std::size_t kCount = 64;
constexpr const char* kSource = R"(
__kernel void positive(__global const float* in, __global float* out) {
  const size_t i = get_global_id(0);
  out[i] = in[i] > 0.0f ? 1.0f : 2.0f;
  if (in[i] > 0.0f) out[i] += 1.0f;
})";

/// Every element of `in` is positive, so the kernel writes 2 everywhere.
bool reads_what_was_written(cl::Context& context, cl::CommandQueue& queue, cl::Program& program,
                            const cl::Buffer& in) {
  std::vector<float> result(kCount, 0.0f);
  const cl::Buffer out(context, CL_MEM_READ_WRITE, kCount * sizeof(float));
  cl::KernelFunctor<cl::Buffer, cl::Buffer> positive(program, "positive");
  positive(cl::EnqueueArgs(queue, cl::NDRange(kCount)), in, out);
  queue.enqueueReadBuffer(out, CL_TRUE, 0, kCount * sizeof(float), result.data());
  return result == std::vector<float>(kCount, 2.0f);
}

}  // namespace

int main() {
  const cl::Context context(CL_DEVICE_TYPE_ALL);
  cl::Context same = context;
  cl::CommandQueue queue(context);
  cl::Program program(context, kSource, true);
  const std::vector<float> ones(kCount, 1.0f);
  constexpr std::size_t half = kCount / 2 * sizeof(float);

  const cl::Buffer pieces(context, CL_MEM_READ_WRITE, 2 * half), filled(context, CL_MEM_READ_WRITE, 2 * half);
  queue.enqueueWriteBuffer(pieces, CL_TRUE, 0, half, ones.data());
  queue.enqueueWriteBuffer(pieces, CL_TRUE, half, half, ones.data());
  queue.enqueueFillBuffer(filled, 1.0f, 0, 2 * half);
  const bool right = reads_what_was_written(same, queue, program, pieces) &&
                     reads_what_was_written(same, queue, program, filled);
  std::puts(right ? "every element was read as it was written" : "elements were read wrongly");
  return right ? 0 : 1;
}
