// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/shared_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace veduta {
namespace {

Status Failed(const char* what) {
  return Status::IoError(std::string("cannot ") + what +
                         " memory for a photo: " + std::generic_category().message(errno));
}

Result<Descriptor> MakeMemory() {
  Descriptor memory(memfd_create("veduta-photo", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (memory.number() < 0) return Failed("get");
  return memory;
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

Result<Descriptor> ShareForReading(std::span<const uint8_t> bytes) {
  VEDUTA_ASSIGN_OR_RETURN(Descriptor memory, MakeMemory());
  while (!bytes.empty()) {
    const ssize_t written = write(memory.number(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return Failed("fill");
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  constexpr int kSeals = F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
  if (fcntl(memory.number(), F_ADD_SEALS, kSeals) != 0) return Failed("seal");
  return memory;
}

Result<Descriptor> ShareForWriting(uint64_t size_bytes) {
  VEDUTA_ASSIGN_OR_RETURN(Descriptor memory, MakeMemory());
  if (ftruncate(memory.number(), static_cast<off_t>(size_bytes)) != 0) return Failed("get");
  constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
  if (fcntl(memory.number(), F_ADD_SEALS, kSeals) != 0) return Failed("seal");
  return memory;
}

Result<MappedMemory> MappedMemory::Map(int descriptor, uint64_t size_bytes, Access access) {
  struct stat is {};
  if (fstat(descriptor, &is) != 0) return Failed("look at");
  if (size_bytes == 0 || static_cast<uint64_t>(is.st_size) != size_bytes)
    return Status::IoError("memory for a photo is not of the size that was told");
  const bool writes = access == Access::kWrite;
  void* const start = mmap(nullptr, size_bytes, writes ? PROT_READ | PROT_WRITE : PROT_READ,
                           (writes ? MAP_SHARED : MAP_PRIVATE) | MAP_POPULATE, descriptor, 0);
  if (start == MAP_FAILED) return Failed("map");
  return MappedMemory(static_cast<uint8_t*>(start), size_bytes);
}

MappedMemory::~MappedMemory() {
  if (start_ != nullptr) munmap(start_, size_bytes_);
}

}  // namespace veduta
