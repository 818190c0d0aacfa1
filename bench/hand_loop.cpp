// The hand-written loop. AVX-512 is a function attribute, so that the program still starts on processors
// without it.
#include "bench/hand_loop.hpp"

#include <cmath>

#include "host/base/system/parallel.hpp"

#if defined(__x86_64__) && defined(__GNUC__)
#define VDVR_HAND_LOOP 1
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#include <immintrin.h>
#pragma GCC diagnostic pop
#endif

namespace vdvr::bench {

#ifdef VDVR_HAND_LOOP
namespace {

struct View {
  float along_x, along_y, start;
};

// One row of columns, for two chunks of z: eight columns share the position's arithmetic, two chunks the
// weights.
__attribute__((target("avx512f,fma"))) void row_of_columns(const HandLoop& loop, const View* views,
                                                           std::int64_t y, std::int64_t chunk, float* out) {
  const std::int64_t plane = loop.columns * 16, above = loop.views * plane, stride = loop.chunks * 16;
  const __m256 eight = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
  alignas(32) float w0[8], w1[8];
  alignas(32) int at[8];
  for (std::int64_t x = 0; x < loop.nx; x += 8) {
    __m512 low[8], high[8];
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i) low[i] = high[i] = _mm512_setzero_ps();
    const float* q = loop.filtered.data() + chunk * above;
    for (std::int64_t k = 0; k < loop.views; ++k, q += plane) {
      const View& v = views[k];
      const __m256 s = _mm256_fmadd_ps(_mm256_set1_ps(v.along_x),
                                       _mm256_add_ps(_mm256_set1_ps(static_cast<float>(x)), eight),
                                       _mm256_set1_ps(std::fma(v.along_y, static_cast<float>(y), v.start)));
      const __m256i below = _mm256_cvttps_epi32(s);
      const __m256 f = _mm256_sub_ps(s, _mm256_cvtepi32_ps(below));
      _mm256_store_ps(w1, f);
      _mm256_store_ps(w0, _mm256_sub_ps(_mm256_set1_ps(1), f));
      _mm256_store_si256(reinterpret_cast<__m256i*>(at), _mm256_slli_epi32(below, 4));
#pragma GCC unroll 8
      for (int i = 0; i < 8; ++i) {
        const float* p = q + at[i];
        const __m512 left = _mm512_set1_ps(w0[i]), right = _mm512_set1_ps(w1[i]);
        low[i] = _mm512_fmadd_ps(left, _mm512_load_ps(p), low[i]);
        low[i] = _mm512_fmadd_ps(right, _mm512_load_ps(p + 16), low[i]);
        high[i] = _mm512_fmadd_ps(left, _mm512_load_ps(p + above), high[i]);
        high[i] = _mm512_fmadd_ps(right, _mm512_load_ps(p + above + 16), high[i]);
      }
    }
    float* target = out + (y * loop.nx + x) * stride + chunk * 16;
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i) {
      _mm512_storeu_ps(target + i * stride, low[i]);
      _mm512_storeu_ps(target + i * stride + 16, high[i]);
    }
  }
}

}  // namespace

std::string hand_loop_missing() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("fma")
             ? ""
             : "this processor has no AVX-512: no hand-written loop to compare with";
}

void run_hand_loop(const HandLoop& loop, std::span<float> out) {
  std::vector<View> views;
  for (const double theta : loop.theta_rad) {
    const double c = std::cos(theta) * loop.scale, s = std::sin(theta) * loop.scale;
    views.push_back({static_cast<float>(c * loop.step), static_cast<float>(s * loop.step),
                     static_cast<float>((c + s) * loop.first + loop.offset)});
  }
  // Rows of one chunk after another: their projections stay in the caches.
  const std::int64_t bands = (loop.ny + 7) / 8;
  parallel_for(loop.chunks / 2 * bands, {}, "", [&](std::int64_t task) {
    const std::int64_t y0 = task % bands * 8;
    for (std::int64_t y = y0; y < std::min(y0 + 8, loop.ny); ++y)
      row_of_columns(loop, views.data(), y, task / bands * 2, out.data());
  });
}
#else
std::string hand_loop_missing() {
  return "built without AVX-512 intrinsics: no hand-written loop to compare with";
}
void run_hand_loop(const HandLoop&, std::span<float>) {}
#endif

}  // namespace vdvr::bench
