// SPDX-License-Identifier: Apache-2.0
// All texts of the page, in English and German. The daemon's own words stay English.
import { keepValue, keptValue } from "./kept";

const ENGLISH = {
  skip: "Skip to the lists",
  view:
    "Model of the city. Arrow keys turn it, plus and minus bring it nearer or farther, Home " +
    "shows all. P shows the plan, which arrow keys move, and leaves it.",
  panel: "Lists",
  lists: "Lists of the city",
  fold: "Show the lists",
  language: "Deutsch",
  token_button: "Token",
  overview: "Show all",
  plan: "Plan",
  north_up: "North is up",
  north_unknown: "North is not known yet",
  scale: "The bar is {length} long",
  layers: "What is drawn",
  layer_points: "Points",
  layer_surface: "Surface",
  layer_both: "Both",
  no_webgl:
    "This browser cannot draw the model, since it has no WebGL. The lists work nevertheless.",
  empty: "The city has no model yet. Contribute photos that show the same place.",
  tab_photos: "Photos",
  tab_reconstructions: "Models",
  tab_seams: "Seams",
  tab_history: "History",
  tab_contribute: "Contribute",
  search: "Search by name or contributor",
  photos_found: "{count} of {total} photos",
  more: "{count} more",
  older: "Earlier entries",
  nothing: "Nothing here.",
  model: "Model {number}",
  model_line: "{images} photos, {points} points, error {error} px",
  shown: "shown",
  seam: "Models {a} and {b}",
  seam_line: "{common} common points; {for} pairs agree, {against} contradict",
  seams_intro:
    "Doubtful seams. These models may be one. They are not merged before the evidence is " +
    "clear.",
  no_seams: "No seam is doubtful.",
  placed: "placed",
  merged: "merged two models",
  founded: "founded a model",
  postponed: "postponed",
  rejected: "rejected",
  duplicate: "duplicate",
  failed: "failed",
  unsure: "may stand elsewhere",
  back: "Back to the lists",
  by: "by {who}, {when}",
  verdict: "Verdict",
  reason: "Reason",
  features: "Evidence",
  features_line: "{observations} of {features} features see points",
  in_model: "Model",
  none: "none",
  may_stand_in: "May also stand in",
  licence: "Licence",
  remark: "Comment",
  neighbors: "Neighbours",
  neighbor_line: "{matches} matches",
  no_neighbors: "No photo was verified against it.",
  hypotheses: "Doubtful seams of its model",
  fly: "Fly there",
  leave: "Leave the photo (Escape)",
  opacity: "Opacity of the photo",
  thumbnail_of: "Photo {name}",
  no_thumbnail: "There is no picture of it: {detail}",
  drop: "Drop photos here, or",
  choose: "Choose photos",
  contributor: "Your name",
  contributor_token: "Your name (left empty: that of your token)",
  camera: "Camera",
  camera_any: "find it by the photo",
  comment: "Comment on these photos (may be left empty)",
  licence_label: "Licence of these photos (may be left empty)",
  stage_line: "in the line of this page",
  stage_sending: "sending",
  stage_later: "the city is busy; it is sent again",
  stage_lost: "the connection is lost; it is sent again",
  stage_waiting: "on the disk, waits for its turn",
  stage_broken: "not sent: the file cannot be read, or the connection breaks off each time",
  stage_refused: "refused",
  stage_unknown: "its turn has come, but the daemon has forgotten what became of it",
  show_photo: "Show",
  sent_summary: "{done} of {total} photos are done",
  did_add: "added",
  did_camera: "added a camera",
  did_vocabulary: "trained the vocabulary",
  did_adjust: "adjusted",
  did_propagate: "tried again",
  did_merge: "merged",
  did_judge: "judged a seam",
  did_hypothesis: "proposed a merge",
  did_doubt: "took the pose of",
  did_split: "split",
  did_remove: "removed",
  did_forbid: "forbade",
  did_allow: "allowed",
  did_georeference: "found the place on the earth of",
  did_ground: "brought surveyed points",
  did_token: "changed a token",
  did_hide: "hid",
  did_unhide: "showed again",
  did_report: "reported",
  did_dismiss: "dismissed a report of",
  did_contribution: "changed a contribution",
  did_repair: "repaired",
  did_densify: "made dense",
  photo_number: "photo {number}",
  status_lost: "The connection to the city is lost. It is tried again.",
  status_back: "The connection is there again.",
  status_busy: "Too many follow the city just now. News comes later.",
  status_error: "The city answers: {detail}",
  status_token: "The city asks for a token.",
  tab_reports: "Reports",
  reports_intro:
    "What people have reported. A photo that is hidden is shown to curators alone; the model " +
    "keeps what it has by it.",
  no_reports: "No report waits.",
  report: "Report this photo",
  report_title: "What is wrong with this photo?",
  report_reason: "Reason",
  report_privacy: "It shows people, number plates or a home",
  report_copyright: "It is somebody else's work",
  report_offensive: "It must not be shown",
  report_wrong: "It is of another place, or no photo",
  report_other: "Something else",
  report_text: "For the curators (may be left empty)",
  report_send: "Report",
  report_cancel: "Cancel",
  report_sent: "Thank you. A curator will look at it.",
  hide_photo: "Hide the photo",
  unhide_photo: "Show the photo again",
  erase_photo: "Erase the photo",
  erase_title: "Erase this photo for good?",
  erase_text:
    "The photo and all that was made from it leave the city. Only backups that were made before " +
    "can bring it back. The history keeps who erased it, when and why.",
  erase_why: "Why (may be left empty)",
  erase_now: "Erase for good",
  erasing: "The photo is being erased…",
  erased: "The photo is erased.",
  erased_later: "The photo is erased. Its bytes leave the disk a little later: {why}",
  erased_copies: "Copies of the city may still hold it: {copies}",
  dismiss: "Leave it as it is",
  hidden: "hidden",
  seen_by: "Visibility",
  token_title: "A token is needed",
  token_text:
    "The city opens with a token that its owner gives. It is kept until this tab is closed.",
  token_label: "Token",
  token_enter: "Enter",
  token_cancel: "Cancel",
  token_forget: "Forget the token",
};

export type WordKey = keyof typeof ENGLISH;

const GERMAN: Record<WordKey, string> = {
  skip: "Zu den Listen springen",
  view:
    "Modell der Stadt. Pfeiltasten drehen es, Plus und Minus holen es heran oder rücken es " +
    "weg, Pos1 zeigt alles. P zeigt den Grundriss, den Pfeiltasten verschieben, und verlässt ihn.",
  panel: "Listen",
  lists: "Listen der Stadt",
  fold: "Listen zeigen",
  language: "English",
  token_button: "Token",
  overview: "Alles zeigen",
  plan: "Grundriss",
  north_up: "Norden ist oben",
  north_unknown: "Norden ist noch nicht bekannt",
  scale: "Der Balken ist {length} lang",
  layers: "Was gezeichnet wird",
  layer_points: "Punkte",
  layer_surface: "Oberfläche",
  layer_both: "Beides",
  no_webgl:
    "Dieser Browser kann das Modell nicht zeichnen, denn ihm fehlt WebGL. Die Listen gehen " +
    "trotzdem.",
  empty: "Die Stadt hat noch kein Modell. Tragen Sie Fotos bei, die denselben Ort zeigen.",
  tab_photos: "Fotos",
  tab_reconstructions: "Modelle",
  tab_seams: "Nähte",
  tab_history: "Verlauf",
  tab_contribute: "Beitragen",
  search: "Nach Name oder Beitragenden suchen",
  photos_found: "{count} von {total} Fotos",
  more: "{count} weitere",
  older: "Frühere Einträge",
  nothing: "Hier ist nichts.",
  model: "Modell {number}",
  model_line: "{images} Fotos, {points} Punkte, Fehler {error} px",
  shown: "gezeigt",
  seam: "Modelle {a} und {b}",
  seam_line: "{common} gemeinsame Punkte; {for} Paare stimmen zu, {against} widersprechen",
  seams_intro:
    "Zweifelhafte Nähte. Diese Modelle sind vielleicht eines. Sie werden erst vereint, wenn " +
    "die Belege klar sind.",
  no_seams: "Keine Naht ist zweifelhaft.",
  placed: "verortet",
  merged: "hat zwei Modelle vereint",
  founded: "hat ein Modell begründet",
  postponed: "zurückgestellt",
  rejected: "abgelehnt",
  duplicate: "doppelt",
  failed: "fehlgeschlagen",
  unsure: "steht vielleicht woanders",
  back: "Zurück zu den Listen",
  by: "von {who}, {when}",
  verdict: "Urteil",
  reason: "Grund",
  features: "Belege",
  features_line: "{observations} von {features} Merkmalen sehen Punkte",
  in_model: "Modell",
  none: "keines",
  may_stand_in: "Steht vielleicht auch in",
  licence: "Lizenz",
  remark: "Kommentar",
  neighbors: "Nachbarn",
  neighbor_line: "{matches} Treffer",
  no_neighbors: "Kein Foto wurde damit bestätigt.",
  hypotheses: "Zweifelhafte Nähte seines Modells",
  fly: "Dorthin fliegen",
  leave: "Foto verlassen (Escape)",
  opacity: "Deckkraft des Fotos",
  thumbnail_of: "Foto {name}",
  no_thumbnail: "Es gibt kein Bild davon: {detail}",
  drop: "Fotos hierher ziehen oder",
  choose: "Fotos auswählen",
  contributor: "Ihr Name",
  contributor_token: "Ihr Name (leer: der Ihres Tokens)",
  camera: "Kamera",
  camera_any: "aus dem Foto ermitteln",
  comment: "Kommentar zu diesen Fotos (kann leer bleiben)",
  licence_label: "Lizenz dieser Fotos (kann leer bleiben)",
  stage_line: "in der Reihe dieser Seite",
  stage_sending: "wird gesendet",
  stage_later: "die Stadt ist ausgelastet; es wird noch einmal gesendet",
  stage_lost: "die Verbindung ist weg; es wird noch einmal gesendet",
  stage_waiting: "gespeichert, wartet, bis es an der Reihe ist",
  stage_broken:
    "nicht gesendet: die Datei ist nicht lesbar, oder die Verbindung bricht jedes Mal ab",
  stage_refused: "nicht angenommen",
  stage_unknown: "es war an der Reihe, aber der Dienst weiß nicht mehr, was daraus wurde",
  show_photo: "Zeigen",
  sent_summary: "{done} von {total} Fotos sind fertig",
  did_add: "hinzugefügt",
  did_camera: "Kamera hinzugefügt",
  did_vocabulary: "Vokabular gelernt",
  did_adjust: "ausgeglichen",
  did_propagate: "noch einmal versucht",
  did_merge: "vereint",
  did_judge: "Naht beurteilt",
  did_hypothesis: "Vereinigung vorgeschlagen",
  did_doubt: "Pose genommen",
  did_split: "geteilt",
  did_remove: "entfernt",
  did_forbid: "verboten",
  did_allow: "erlaubt",
  did_georeference: "Ort auf der Erde gefunden",
  did_ground: "vermessene Punkte gebracht",
  did_token: "Token geändert",
  did_hide: "verborgen",
  did_unhide: "wieder gezeigt",
  did_report: "gemeldet",
  did_dismiss: "Meldung abgewiesen zu",
  did_contribution: "Beitrag geändert",
  did_repair: "repariert",
  did_densify: "verdichtet",
  photo_number: "Foto {number}",
  status_lost: "Die Verbindung zur Stadt ist weg. Es wird weiter versucht.",
  status_back: "Die Verbindung ist wieder da.",
  status_busy: "Gerade folgen zu viele der Stadt. Neues kommt später.",
  status_error: "Die Stadt antwortet: {detail}",
  status_token: "Die Stadt verlangt ein Token.",
  tab_reports: "Meldungen",
  reports_intro:
    "Was gemeldet wurde. Ein verborgenes Foto sehen nur Kuratierende; das Modell behält, was " +
    "es durch das Foto hat.",
  no_reports: "Keine Meldung wartet.",
  report: "Dieses Foto melden",
  report_title: "Was stimmt mit diesem Foto nicht?",
  report_reason: "Grund",
  report_privacy: "Es zeigt Menschen, Kennzeichen oder eine Wohnung",
  report_copyright: "Es ist das Werk einer anderen Person",
  report_offensive: "Es darf nicht gezeigt werden",
  report_wrong: "Es zeigt einen anderen Ort oder ist kein Foto",
  report_other: "Etwas anderes",
  report_text: "Für die Kuratierenden (kann leer bleiben)",
  report_send: "Melden",
  report_cancel: "Abbrechen",
  report_sent: "Danke. Jemand wird es sich ansehen.",
  hide_photo: "Foto verbergen",
  unhide_photo: "Foto wieder zeigen",
  erase_photo: "Foto löschen",
  erase_title: "Dieses Foto endgültig löschen?",
  erase_text:
    "Das Foto und alles, was daraus entstand, verlässt die Stadt. Nur Sicherungen von vorher " +
    "können es zurückbringen. Die Chronik behält, wer es wann und warum gelöscht hat.",
  erase_why: "Warum (kann leer bleiben)",
  erase_now: "Endgültig löschen",
  erasing: "Das Foto wird gelöscht…",
  erased: "Das Foto ist gelöscht.",
  erased_later: "Das Foto ist gelöscht. Seine Bytes verlassen die Platte etwas später: {why}",
  erased_copies: "Kopien der Stadt können es noch enthalten: {copies}",
  dismiss: "So lassen",
  hidden: "verborgen",
  seen_by: "Sichtbarkeit",
  token_title: "Ein Token wird gebraucht",
  token_text:
    "Die Stadt öffnet sich mit einem Token, das die Person vergibt, der sie gehört. Es " +
    "bleibt, bis dieser Tab geschlossen wird.",
  token_label: "Token",
  token_enter: "Eingeben",
  token_cancel: "Abbrechen",
  token_forget: "Token vergessen",
};

export type Language = "en" | "de";

const LANGUAGE_KEY = "veduta.language";

let language: Language = chosen();

function chosen(): Language {
  const kept = keptValue("localStorage", LANGUAGE_KEY);
  if (kept === "en" || kept === "de") return kept;
  return navigator.language.toLowerCase().startsWith("de") ? "de" : "en";
}

export function currentLanguage(): Language {
  return language;
}

export function setLanguage(next: Language): void {
  language = next;
  keepValue("localStorage", LANGUAGE_KEY, next);
}

export function isWordKey(key: string): key is WordKey {
  return Object.hasOwn(ENGLISH, key);
}

// The text with its {names} filled in.
export function t(key: WordKey, values: Record<string, string | number> = {}): string {
  const text = (language === "de" ? GERMAN : ENGLISH)[key];
  return text.replace(/\{(\w+)\}/g, (whole, name: string) => {
    const value = values[name];
    return typeof value === "number" ? number(value) : (value ?? whole);
  });
}

export function number(value: number, digits = 0): string {
  return new Intl.NumberFormat(language, { maximumFractionDigits: digits }).format(value);
}

export function moment(seconds: number): string {
  const format = new Intl.DateTimeFormat(language, { dateStyle: "medium", timeStyle: "short" });
  return format.format(new Date(1000 * seconds));
}
