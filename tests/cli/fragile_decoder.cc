// SPDX-License-Identifier: Apache-2.0
// `veduta-decoder` with a TurboJPEG that has faults, as one that a hostile photo uses: a comment in
// a JPEG says which. The linker has all calls of tjDecompress2 come here (-Wl,--wrap).
#include <fcntl.h>
#include <turbojpeg.h>

#include <cstdint>
#include <cstring>
#include <new>
#include <string_view>
#include <vector>

// NOLINTBEGIN: the linker chooses the names.
extern "C" int __real_tjDecompress2(tjhandle handle, const unsigned char* jpeg, unsigned long size,
                                    unsigned char* pixels, int width, int pitch, int height,
                                    int format, int flags);

extern "C" int __wrap_tjDecompress2(tjhandle handle, const unsigned char* jpeg, unsigned long size,
                                    unsigned char* pixels, int width, int pitch, int height,
                                    int format, int flags) {
  const std::string_view bytes(reinterpret_cast<const char*>(jpeg), size);
  const auto wants = [&](std::string_view fault) {
    return bytes.substr(0, 256).find(fault) != std::string_view::npos;
  };
  volatile uintptr_t nowhere = 16;  // the compiler is not to see that nothing lies there
  if (wants("fault:crash")) *reinterpret_cast<volatile char*>(nowhere) = 1;
  if (wants("fault:open")) open("/etc/passwd", O_RDONLY);
  while (wants("fault:loop")) std::memset(pixels, 1, static_cast<size_t>(width));
  if (wants("fault:hoard")) {
#ifdef VEDUTA_SANITIZED
    throw std::bad_alloc();  // there is no limit then
#endif
    for (std::vector<std::vector<char>> hoard;;) hoard.emplace_back(1 << 24, 'x');
  }
  return __real_tjDecompress2(handle, jpeg, size, pixels, width, pitch, height, format, flags);
}
// NOLINTEND
