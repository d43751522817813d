// SPDX-License-Identifier: Apache-2.0
// The dialog by which somebody tells the curators that something is wrong with a photo.
import { REPORT_REASONS } from "./answers";
import { el } from "./dom";
import type { WordKey } from "./words";

const TEXT_LENGTH_MAX = 500; // 2000 bytes of UTF-8 at most

export class ReportForm {
  readonly element = el("dialog", { attributes: { "aria-labelledby": "report-title" } });
  private readonly reason = el("select", { id: "report-reason" });
  private readonly text = el("textarea", {
    id: "report-text",
    attributes: { rows: "3", maxlength: String(TEXT_LENGTH_MAX) },
  });
  private photo = 0;

  constructor(private readonly onReport: (photo: number, reason: string, text: string) => void) {
    for (const one of REPORT_REASONS) {
      const words: WordKey = `report_${one}`;
      this.reason.append(el("option", { words, attributes: { value: one } }));
    }
    const form = el("form");
    const cancel = el("button", { words: "report_cancel" });
    const send = el("button", { class: "main", words: "report_send" });
    send.type = "submit";
    form.append(
      el("h2", { id: "report-title", words: "report_title" }),
      el("label", { words: "report_reason", attributes: { for: "report-reason" } }),
      this.reason,
      el("label", { words: "report_text", attributes: { for: "report-text" } }),
      this.text,
      el("div", { class: "buttons" }, send, cancel),
    );
    this.element.append(form);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.element.close();
      this.onReport(this.photo, this.reason.value, this.text.value);
    });
    cancel.addEventListener("click", () => this.element.close());
  }

  ask(photo: number): void {
    this.photo = photo;
    this.reason.selectedIndex = 0;
    this.text.value = "";
    this.element.showModal();
  }
}
