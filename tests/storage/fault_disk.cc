// SPDX-License-Identifier: Apache-2.0
#include "tests/storage/fault_disk.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>

namespace veduta {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kPageBytes = 4096;   // what Linux writes to a disk at once
constexpr uint64_t kSectorBytes = 512;  // what a disk writes whole

// Whether a thing that is not durable outlives the power cut.
class Choices final {
 public:
  explicit Choices(std::optional<uint64_t> seed) : is_worst_(!seed), random_(seed.value_or(0)) {
    // A disk in a hurry has written all or nothing at all times; most lie in between.
    share_percent_ = std::array<uint32_t, 4>{0, 30, 70, 100}[random_.Below(4)];
  }
  bool is_worst() const { return is_worst_; }
  bool Keeps() { return !is_worst_ && random_.Below(100) < share_percent_; }
  uint64_t Between(uint64_t low, uint64_t high) {
    return low + random_.Below(static_cast<uint32_t>(high - low + 1));
  }

 private:
  const bool is_worst_;
  SeededRandom random_;
  uint32_t share_percent_ = 0;
};

void WriteAt(std::fstream* file, uint64_t offset, const std::string& bytes) {
  file->seekp(static_cast<std::streamoff>(offset));
  file->write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Of an unsynced tail, any of its pages may be zeros, or be torn: its length is written before.
void LoseTail(const std::string& path, const FaultDisk::Content& content, Choices* choices) {
  const uint64_t size = fs::file_size(path);
  if (size <= content.synced) return;
  if (choices->is_worst()) return fs::resize_file(path, content.synced);
  uint64_t end = choices->Between(0, 2) == 0 ? content.synced : size;
  if (!choices->Keeps() && end == size) end = choices->Between(content.synced, size);
  fs::resize_file(path, end);
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  for (uint64_t begin = content.synced; begin < end;) {
    const uint64_t next = std::min(end, (begin / kPageBytes + 1) * kPageBytes);
    const bool is_torn = choices->Between(0, 7) == 0;
    if (is_torn || !choices->Keeps()) {
      const uint64_t tear = choices->Between(begin, next) / kSectorBytes * kSectorBytes;
      const uint64_t from = is_torn ? std::max(begin, tear) : begin;
      WriteAt(&file, from, std::string(next - from, '\0'));
    }
    begin = next;
  }
}

// Of pages that were written in place, each is the old one, the new one, or the begin of the new
// one and the end of the old one.
void LoseOverwritten(const std::string& path, const FaultDisk::Content& content, Choices* choices) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  for (const auto& [page, before] : content.pages_before) {
    if (choices->Keeps()) continue;
    const bool is_torn = !choices->is_worst() && choices->Between(0, 7) == 0;
    const uint64_t from = is_torn ? choices->Between(0, before.size()) : 0;
    WriteAt(&file, page * kPageBytes + from, before.substr(from));
  }
}

bool IsInside(const std::string& path, const std::string& folder) {
  return path == folder || path.starts_with(folder + "/");
}

}  // namespace

const char* OperationName(Operation operation) {
  constexpr std::array<const char*, kOperationKinds> kNames = {
      "create", "write", "overwrite", "sync", "rename", "delete", "read"};
  return kNames[static_cast<size_t>(operation)];
}

FaultDisk::Content::~Content() {
  if (spare.empty()) return;
  std::error_code ignored;  // the folder of spare links goes with the disk
  fs::remove(spare, ignored);
}

FaultDisk::~FaultDisk() {
  files_.clear();
  changes_.clear();
  std::error_code ignored;
  if (!spare_folder_.empty()) fs::remove_all(spare_folder_, ignored);
}

void FaultDisk::Fail(Operations kinds, uint64_t n, Fault fault, uint64_t count) {
  const std::lock_guard lock(mutex_);
  fault_ = fault;
  failing_ = kinds;
  seen_ = 0;
  first_failing_ = n;
  failing_count_ = count;
  faults_ = {};
}

void FaultDisk::CutPower() {
  const std::lock_guard lock(mutex_);
  power_is_out_ = true;
}

void FaultDisk::Heal() {
  const std::lock_guard lock(mutex_);
  power_is_out_ = false;
  failing_count_ = 0;
}

OperationCounts FaultDisk::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

OperationCounts FaultDisk::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

rocksdb::IOStatus FaultDisk::Begin(Operation operation) {
  if (power_is_out_ && operation != Operation::kRead)
    return rocksdb::IOStatus::IOError("the power is out");
  ++counts_[static_cast<size_t>(operation)];
  if (failing_count_ == 0 || (failing_ & Only(operation)) == 0) return rocksdb::IOStatus::OK();
  ++seen_;
  if (seen_ < first_failing_ || seen_ - first_failing_ >= failing_count_)
    return rocksdb::IOStatus::OK();
  ++faults_[static_cast<size_t>(operation)];
  return fault_ == Fault::kNoSpace
             ? rocksdb::IOStatus::NoSpace("injected fault", "No space left on device")
             : rocksdb::IOStatus::IOError("injected fault");
}

std::string FaultDisk::Normal(const std::string& path) {
  const fs::path normal = fs::absolute(path).lexically_normal();
  return (normal.has_filename() ? normal : normal.parent_path()).string();
}

std::shared_ptr<FaultDisk::Content> FaultDisk::Track(const std::string& path) {
  std::shared_ptr<Content>& content = files_[Normal(path)];
  if (content == nullptr) {
    content = std::make_shared<Content>();
    content->size = content->synced = fs::file_size(path);
  }
  return content;
}

std::shared_ptr<FaultDisk::Content> FaultDisk::StartAnew(const std::string& path, bool is_new) {
  const std::string normal = Normal(path);
  const auto content = std::make_shared<Content>();
  // A file that was cut to nothing has no entry made: other names of it, and spare links, are not
  // wanted any more.
  files_[normal] = content;
  if (is_new) changes_.push_back({Change::kMade, normal, "", content, nullptr});
  return content;
}

void FaultDisk::FolderMade(const std::string& path) {
  changes_.push_back({Change::kFolderMade, Normal(path), "", nullptr, nullptr});
}

void FaultDisk::Linked(const std::string& from, const std::string& to) {
  const std::shared_ptr<Content> content = Track(from);
  files_[Normal(to)] = content;
  changes_.push_back({Change::kMade, Normal(to), "", content, nullptr});
}

// The file may lose its last name: the bytes are kept for the power cut.
void FaultDisk::KeepSpare(const std::string& path, Content* content) {
  if (!content->spare.empty()) return;
  if (spare_folder_.empty()) {
    std::string pattern = (fs::temp_directory_path() / "veduta_spare_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) return;
    spare_folder_ = pattern;
  }
  const std::string spare = spare_folder_ + "/" + std::to_string(++spare_count_);
  std::error_code failed;
  fs::create_hard_link(path, spare, failed);
  if (!failed) content->spare = spare;
}

void FaultDisk::BeforeDelete(const std::string& path) {
  const std::shared_ptr<Content> content = Track(path);
  KeepSpare(path, content.get());
  changes_.push_back({Change::kDeleted, Normal(path), "", content, nullptr});
}

void FaultDisk::BeforeRename(const std::string& from, const std::string& to) {
  const std::string old_path = Normal(from), new_path = Normal(to);
  if (fs::is_directory(from)) {
    changes_.push_back({Change::kFolderRenamed, new_path, old_path, nullptr, nullptr});
    return;
  }
  Change change{Change::kRenamed, new_path, old_path, Track(from), nullptr};
  if (fs::is_regular_file(to)) {
    change.replaced = Track(to);
    KeepSpare(to, change.replaced.get());
  }
  changes_.push_back(std::move(change));
}

void FaultDisk::UndoLast() {
  changes_.pop_back();
}

void FaultDisk::Happened() {
  const Change& change = changes_.back();
  if (change.kind == Change::kDeleted) {
    files_.erase(change.path);
    return;
  }
  files_.erase(change.path);
  MoveTracked(change.renamed_from, change.path);
}

// Renames what is known under `from`, a file or a folder with what is in it.
void FaultDisk::MoveTracked(const std::string& from, const std::string& to) {
  Entries moved;
  for (auto it = files_.begin(); it != files_.end();) {
    if (IsInside(it->first, from)) {
      moved[to + it->first.substr(from.size())] = it->second;
      it = files_.erase(it);
    } else {
      ++it;
    }
  }
  files_.merge(moved);
  for (Change& change : changes_) {
    if (change.path != from && IsInside(change.path, from))
      change.path = to + change.path.substr(from.size());
    if (change.renamed_from != from && IsInside(change.renamed_from, from))
      change.renamed_from = to + change.renamed_from.substr(from.size());
  }
}

void FaultDisk::BeforeOverwrite(const std::string& path, Content* content, uint64_t begin,
                                uint64_t end) {
  std::ifstream file(path, std::ios::binary);
  for (uint64_t page = begin / kPageBytes; page * kPageBytes < end; ++page) {
    if (content->pages_before.contains(page)) continue;
    std::string bytes(kPageBytes, '\0');
    file.clear();
    file.seekg(static_cast<std::streamoff>(page * kPageBytes));
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    content->pages_before[page] = bytes;
  }
}

void FaultDisk::FolderSynced(const std::string& path) {
  std::erase_if(changes_,
                [&](const Change& c) { return fs::path(c.path).parent_path().string() == path; });
}

// The entries that the power cut leaves, of those that a change names; none for a name that is
// gone.
FaultDisk::Entries FaultDisk::EntriesAfter(const std::vector<bool>& kept) const {
  Entries entries;
  for (const Change& c : changes_) {
    for (const std::string& path : {c.path, c.renamed_from}) {
      const auto found = files_.find(path);
      if (!path.empty()) entries[path] = found == files_.end() ? nullptr : found->second;
    }
  }
  // First back to what was durable, then forward again over what is kept.
  for (auto c = changes_.rbegin(); c != changes_.rend(); ++c) {
    if (c->kind == Change::kMade) entries[c->path] = nullptr;
    if (c->kind == Change::kDeleted) entries[c->path] = c->content;
    if (c->kind == Change::kRenamed) {
      entries[c->renamed_from] = c->content;
      entries[c->path] = c->replaced;
    }
  }
  const auto remove = [&](const std::string& path, const std::shared_ptr<Content>& content) {
    if (entries[path] == content) entries[path] = nullptr;
  };
  for (size_t i = 0; i < changes_.size(); ++i) {
    const Change& c = changes_[i];
    if (!kept[i]) continue;
    if (c.kind == Change::kMade) entries[c.path] = c.content;
    if (c.kind == Change::kDeleted) remove(c.path, c.content);
    if (c.kind == Change::kRenamed) {
      entries[c.path] = c.content;
      remove(c.renamed_from, c.content);
    }
  }
  return entries;
}

void FaultDisk::SetEntries(const Entries& entries) {
  for (const auto& [path, content] : entries) {
    const auto now = files_.find(path);
    if (now != files_.end()) KeepSpare(path, now->second.get());
  }
  std::error_code ignored;  // a folder above may be gone already, and the entry with it
  for (const auto& [path, content] : entries) {
    if (fs::is_directory(path)) continue;
    fs::remove(path, ignored);
    files_.erase(path);
    if (content == nullptr) continue;
    fs::create_hard_link(content->spare, path, ignored);
    files_[path] = content;
  }
}

void FaultDisk::UndoFolders(const std::vector<bool>& kept) {
  std::error_code ignored;
  for (size_t i = changes_.size(); i-- > 0;) {
    const Change& c = changes_[i];
    if (kept[i]) continue;
    if (c.kind == Change::kFolderMade) fs::remove_all(c.path, ignored);
    if (c.kind == Change::kFolderRenamed) fs::rename(c.path, c.renamed_from, ignored);
  }
}

void FaultDisk::CutShort(std::optional<uint64_t> seed) {
  const std::lock_guard lock(mutex_);
  Choices choices(seed);
  std::vector<bool> kept;
  for (const Change& change : changes_)
    kept.push_back(choices.is_worst() ? change.kind == Change::kDeleted : choices.Keeps());
  SetEntries(EntriesAfter(kept));
  std::set<const Content*> done;  // a file may have two names
  for (const auto& [path, content] : files_) {
    if (!fs::is_regular_file(path) || !done.insert(content.get()).second) continue;
    if (!content->pages_before.empty()) LoseOverwritten(path, *content, &choices);
    LoseTail(path, *content, &choices);
  }
  UndoFolders(kept);
  changes_.clear();
  files_.clear();
  power_is_out_ = false;
  failing_count_ = 0;
}

BitFlip ChooseBitFlip(const std::string& folder, SeededRandom* random) {
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.file_size() > 0) paths.push_back(entry.path().string());
  }
  if (paths.empty()) return {};
  std::sort(paths.begin(), paths.end());
  const std::string& path = paths[random->Below(static_cast<uint32_t>(paths.size()))];
  const auto size = static_cast<uint32_t>(fs::file_size(path));
  return {path, random->Below(size), static_cast<int>(random->Below(8))};
}

void Apply(const BitFlip& flip) {
  std::fstream file(flip.path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(flip.byte));
  const char byte = static_cast<char>(file.get() ^ (1 << flip.bit));
  file.seekp(static_cast<std::streamoff>(flip.byte));
  file.put(byte);
}

}  // namespace veduta
