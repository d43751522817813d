// SPDX-License-Identifier: Apache-2.0
#include "storage/records/report_record.h"

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string ReportKey(uint32_t number) {
  return std::string(kReportPrefix) + Key32(number);
}

Status ParseReportKey(std::string_view key, ReportRecord* report) {
  if (!key.starts_with(kReportPrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kReportPrefix.size());
  if (!TakeBigEndian32(&key, &report->number) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return report->number > 0 ? Status::Ok() : Status::Corruption("a report with the number 0");
}

Status Check(const ReportRecord& report) {
  if (report.number == 0) return Broken("number of a report", 0, "1 or more");
  if (!report.image.valid()) return Broken("image of a report", 0, "1 or more");
  if (report.reason < ReportReason::kPrivacy || report.reason > ReportReason::kOther)
    return Broken("reason of a report", static_cast<int>(report.reason), "1 to 5");
  if (report.state < ReportState::kOpen || report.state > ReportState::kErased)
    return Broken("state of a report", static_cast<int>(report.state), "1 to 4");
  if ((report.state == ReportState::kOpen) != (report.resolved_unix_s == 0))
    return Broken("time at which a report was resolved", report.resolved_unix_s,
                  "0 exactly while it is open");
  return Status::Ok();
}

Result<std::string> Encode(const ReportRecord& report) {
  VEDUTA_RETURN_IF_ERROR(Check(report));
  const size_t payload = report.text.size() + report.reporter.size() + report.resolver.size();
  return WriteMessage<schema::Report>(payload, [&](auto to) {
    to.setImage(report.image.value);
    to.setReason(static_cast<uint8_t>(report.reason));
    to.setText(AsText(report.text));
    to.setReporter(AsText(report.reporter));
    to.setTimeUnixS(report.time_unix_s);
    to.setState(static_cast<uint8_t>(report.state));
    to.setResolver(AsText(report.resolver));
    to.setResolvedUnixS(report.resolved_unix_s);
  });
}

Status Decode(std::string_view value, ReportRecord* report) {
  return ReadMessage<schema::Report>(value, [&](schema::Report::Reader from) {
    report->image = ImageId(from.getImage());
    report->reason = static_cast<ReportReason>(from.getReason());
    report->text = FromText(from.getText());
    report->reporter = FromText(from.getReporter());
    report->time_unix_s = from.getTimeUnixS();
    report->state = static_cast<ReportState>(from.getState());
    report->resolver = FromText(from.getResolver());
    report->resolved_unix_s = from.getResolvedUnixS();
    return Damaged(Check(*report));
  });
}

}  // namespace veduta
