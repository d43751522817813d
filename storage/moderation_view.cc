// SPDX-License-Identifier: Apache-2.0
#include "storage/moderation_view.h"

#include <utility>

#include "storage/record_finder.h"
#include "storage/records/hidden_record.h"
#include "storage/records/report_record.h"
#include "storage/records/token_use_record.h"
#include "storage/write_buffer.h"

namespace veduta {
namespace {

class ModerationView final : public ModerationReader {
 public:
  explicit ModerationView(const ValueReader& reader) : reader_(reader) {}

  Result<std::vector<HiddenRecord>> ListHidden() const override {
    return ListFacts<HiddenRecord>(reader_, kHiddenPrefix, ParseHiddenKey);
  }

  Result<bool> IsHidden(HiddenKind kind, uint32_t number) const override {
    return reader_.Has(Family::kMeta, HiddenKey(kind, number));
  }

  Result<std::vector<ReportRecord>> ListReports() const override {
    return ListFacts<ReportRecord>(reader_, kReportPrefix, ParseReportKey);
  }

  Result<std::optional<ReportRecord>> FindReport(uint32_t number) const override {
    ReportRecord report;
    report.number = number;
    return FindRecord(reader_, Family::kMeta, ReportKey(number), std::move(report));
  }

  Result<std::vector<TokenUse>> ListTokenUse() const override {
    return ListFacts<TokenUse>(reader_, kTokenUsePrefix, ParseTokenUseKey);
  }

 private:
  const ValueReader& reader_;
};

}  // namespace

std::unique_ptr<const ModerationReader> MakeModerationReader(const ValueReader& reader) {
  return std::make_unique<ModerationView>(reader);
}

Status PutTokenUse(DatabaseFiles& files, std::span<const TokenUse> uses) {
  WriteBuffer batch(files);
  for (const TokenUse& use : uses) batch.Put(Family::kMeta, TokenUseKey(use.token), Encode(use));
  return batch.Write(/*sync=*/false, "note what tokens have used");
}

}  // namespace veduta
