// SPDX-License-Identifier: Apache-2.0
// The dialog by which somebody tells the curators that something is wrong with a photo.
import { REPORT_REASONS } from "./answers";
import { buildDialog } from "./dialog";
import { el } from "./dom";
import type { WordKey } from "./words";

const TEXT_LENGTH_MAX = 500; // 2000 bytes of UTF-8 at most

export class ReportForm {
  readonly element: HTMLDialogElement;
  private readonly reason = el("select", { id: "report-reason" });
  private readonly text = el("textarea", {
    id: "report-text",
    attributes: { rows: "3", maxlength: String(TEXT_LENGTH_MAX) },
  });
  private photo = 0;

  constructor(onReport: (photo: number, reason: string, text: string) => void) {
    for (const one of REPORT_REASONS) {
      const words: WordKey = `report_${one}`;
      this.reason.append(el("option", { words, attributes: { value: one } }));
    }
    this.element = buildDialog({
      name: "report",
      title: "report_title",
      send: "report_send",
      cancel: "report_cancel",
      parts: [
        el("label", { words: "report_reason", attributes: { for: "report-reason" } }),
        this.reason,
        el("label", { words: "report_text", attributes: { for: "report-text" } }),
        this.text,
      ],
      onSend: () => {
        this.element.close();
        onReport(this.photo, this.reason.value, this.text.value);
      },
      onCancel: () => this.element.close(),
    });
  }

  ask(photo: number): void {
    this.photo = photo;
    this.reason.selectedIndex = 0;
    this.text.value = "";
    this.element.showModal();
  }
}
