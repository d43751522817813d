// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which vector instructions this processor has, and which of a loop's variants to call.
//
// The words of all vector code here: an *isa* is a set of vector instructions; *kernels* are a
// table of functions written for one isa; *lanes* are the elements of one vector register. The
// kernels of one name all give the same bytes, so the choice changes nothing but the time.
//
// Kernels for a wider isa than the program's own live in files of their own, NAME_ISA.cc, built
// with that isa's compiler flags. Such files include this header's enum at most, and no templates
// of the standard library: an inline function that is compiled there could be the copy that the
// linker keeps for everybody, also on a processor that lacks the instructions.

#include <cstdint>

namespace veduta {

// Ascending: a processor that has one of them has all before it. No x86 processor has AVX-512 VNNI
// or BW without the four parts listed at kAvx512, except Intel's withdrawn Xeon Phi, which has
// neither VNNI nor BW and counts as kAvx2 here.
enum class CpuIsa : uint8_t {
  kPortable = 0,    // what the whole program is compiled for
  kAvx2 = 1,        //
  kAvx512 = 2,      // AVX-512 F, BW, DQ and VL
  kAvx512Vnni = 3,  // these, and the dot products of bytes
};
inline constexpr CpuIsa kCpuIsas[] = {CpuIsa::kPortable, CpuIsa::kAvx2, CpuIsa::kAvx512,
                                      CpuIsa::kAvx512Vnni};

// "portable", "avx2", "avx512", "avx512vnni".
const char* CpuIsaName(CpuIsa isa);

// The widest isa that this processor and its operating system have, or that a CpuIsaLimit allows.
// The processor is asked once. Thread-safe; a few nanoseconds.
CpuIsa BestCpuIsa();

// While it lives, the program behaves as on a processor whose widest isa is `most`: for tests and
// benchmarks of the narrower kernels. Holds for all threads. Limits nest like scopes.
class CpuIsaLimit final {
 public:
  explicit CpuIsaLimit(CpuIsa most);
  ~CpuIsaLimit();
  CpuIsaLimit(const CpuIsaLimit&) = delete;
  CpuIsaLimit& operator=(const CpuIsaLimit&) = delete;

 private:
  CpuIsa before_;
};

// The kernels of one name for every isa; null where nobody wrote them or this build leaves them
// out (off x86-64). `portable` is never null.
template <typename Kernels>
struct CpuVariants {
  const Kernels* portable = nullptr;
  const Kernels* avx2 = nullptr;
  const Kernels* avx512 = nullptr;
  const Kernels* avx512_vnni = nullptr;

  // The kernels written for exactly this isa; null where there are none or the processor lacks it.
  const Kernels* Find(CpuIsa isa) const {
    if (isa > BestCpuIsa()) return nullptr;
    return isa == CpuIsa::kAvx512Vnni ? avx512_vnni
           : isa == CpuIsa::kAvx512   ? avx512
           : isa == CpuIsa::kAvx2     ? avx2
                                      : portable;
  }
  // The widest kernels that this processor can run.
  const Kernels& Best() const {
    const CpuIsa best = BestCpuIsa();
    if (best >= CpuIsa::kAvx512Vnni && avx512_vnni != nullptr) return *avx512_vnni;
    if (best >= CpuIsa::kAvx512 && avx512 != nullptr) return *avx512;
    if (best >= CpuIsa::kAvx2 && avx2 != nullptr) return *avx2;
    return *portable;
  }
};

}  // namespace veduta
