// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/photo_decoder.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "engine/camera/decoder.h"
#include "engine/camera/gray_image.h"
#include "engine/camera/orientation.h"
#include "engine/camera/pixel_decoders.h"
#include "engine/camera/projection.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

DecodedPhoto Failed(DecodedPhoto photo, DecodeOutcome outcome, std::string detail) {
  photo.outcome = outcome;
  photo.detail = std::move(detail);
  photo.bgr.release();
  photo.gray.release();
  return photo;
}

// Empty if the declared size is within the limits.
std::string Excess(const ImageSize& size, const DecodeLimits& limits) {
  const std::string start = "the photo has " + size.Text() + " px; at most ";
  if (std::max(size.width_px, size.height_px) > limits.side_px_max) {
    return start + std::to_string(limits.side_px_max) + " px a side are taken";
  }
  if (size.pixel_count() > limits.pixels_max)
    return start + std::to_string(limits.pixels_max) + " px in all are taken";
  return "";
}

// Whether the pixels are stored as a mirror shows the place.
bool IsMirrored(int orientation) {
  return orientation == 2 || orientation == 4 || orientation == 5 || orientation == 7;
}

// Sets the layout by the rule in the header; false if neither way round has the size wanted.
bool ChooseLayout(const WantedPixels& wanted, DecodedPhoto* photo) {
  const bool has_upright = wanted.size.empty() || photo->upright_size == wanted.size,
             has_stored = photo->stored_size == wanted.size;
  const bool prefers_stored =
      wanted.preferred == PhotoLayout::kAsStored && !IsMirrored(photo->orientation);
  const bool is_upright = has_upright && !(has_stored && prefers_stored);
  photo->layout = is_upright ? PhotoLayout::kUpright : PhotoLayout::kAsStored;
  return has_upright || has_stored;
}

std::string WrongSizeText(const DecodedPhoto& photo, ImageSize wanted) {
  std::string text = "the photo has " + photo.upright_size.Text() + " px";
  if (photo.stored_size != photo.upright_size)
    text += " (stored as " + photo.stored_size.Text() + ")";
  return text + ", the camera " + wanted.Text();
}

DecodeOutcome OutcomeOf(PixelOutcome outcome) {
  switch (outcome) {
    case PixelOutcome::kDecoded:
      return DecodeOutcome::kDecoded;
    case PixelOutcome::kUnsupportedFormat:
      return DecodeOutcome::kUnsupportedFormat;
    case PixelOutcome::kUnreadable:
      return DecodeOutcome::kUnreadable;
    case PixelOutcome::kNoMemory:
      break;
  }
  return DecodeOutcome::kNoMemory;
}

// `why` may be empty: then there was not enough of it.
DecodedPhoto NoMemory(DecodedPhoto photo, const std::string& why) {
  return Failed(std::move(photo), DecodeOutcome::kNoMemory,
                why.empty() ? "there is not enough memory to decode the photo" : why);
}

// Why a file of these bytes is not even looked at; nothing where it is.
std::optional<DecodedPhoto> RefuseUnseen(std::span<const uint8_t> bytes,
                                         const DecodeLimits& limits) {
  DecodedPhoto photo;
  const Status status = OptionBounds().Part("limits", limits.Check()).status();
  if (!status.ok()) {
    return Failed(std::move(photo), DecodeOutcome::kTooLarge, status.message());
  }
  if (bytes.empty()) return Failed(std::move(photo), DecodeOutcome::kEmpty, "the file is empty");
  if (bytes.size() > limits.size_bytes_max) {
    return Failed(std::move(photo), DecodeOutcome::kTooLarge,
                  "the file has " + std::to_string(bytes.size()) + " bytes; at most " +
                      std::to_string(limits.size_bytes_max) + " are taken");
  }
  return std::nullopt;
}

DecodedPhoto DecodeSeen(const PhotoDecoder& decoder, std::span<const uint8_t> bytes,
                        const PhotoHeader& header, const DecodeLimits& limits,
                        const WantedPixels& wanted) {
  DecodedPhoto photo;
  photo.format = header.format;
  if (header.outcome == HeaderOutcome::kNoMemory) return NoMemory(std::move(photo), header.detail);
  if (header.outcome != HeaderOutcome::kRead) {
    const bool is_unsupported = header.outcome == HeaderOutcome::kUnsupportedFormat;
    return Failed(std::move(photo),
                  is_unsupported ? DecodeOutcome::kUnsupportedFormat : DecodeOutcome::kUnreadable,
                  header.detail);
  }
  photo.orientation = header.orientation;
  photo.stored_size = header.stored_size;
  photo.upright_size = UprightSize(header.stored_size, header.orientation);
  if (std::string excess = Excess(header.stored_size, limits); !excess.empty()) {
    return Failed(std::move(photo), DecodeOutcome::kTooLarge, std::move(excess));
  }
  if (!ChooseLayout(wanted, &photo)) {
    std::string text = WrongSizeText(photo, wanted.size);
    return Failed(std::move(photo), DecodeOutcome::kWrongSize, std::move(text));
  }
  Pixels pixels = decoder.DecodePixels(bytes, header);
  if (pixels.outcome == PixelOutcome::kNoMemory) return NoMemory(std::move(photo), pixels.detail);
  if (pixels.outcome != PixelOutcome::kDecoded) {
    return Failed(std::move(photo), OutcomeOf(pixels.outcome), std::move(pixels.detail));
  }
  photo.outcome = DecodeOutcome::kDecoded;
  photo.bgr =
      photo.layout == PhotoLayout::kUpright ? Upright(pixels.bgr, header.orientation) : pixels.bgr;
  photo.gray = GrayFromBgr(photo.bgr);
  for (const PixelArea& named : ReadPrivateAreas(bytes)) {
    const std::optional<PixelArea> area = ClipArea(named, photo.upright_size);
    if (!area) continue;
    photo.private_areas.push_back(photo.layout == PhotoLayout::kUpright
                                      ? *area
                                      : AreaAsStored(*area, photo.stored_size, header.orientation));
  }
  return photo;
}

}  // namespace

Status DecodeLimits::Check() const {
  return OptionBounds()
      .AtLeast("size_bytes_max", static_cast<double>(size_bytes_max), 1)
      .AtLeast("pixels_max", static_cast<double>(pixels_max), 1)
      .Between("side_px_max", side_px_max, 1, kCameraSideMax)
      .status();
}

DecodedPhoto DecodePhoto(std::span<const uint8_t> bytes, const DecodeLimits& limits,
                         WantedPixels wanted) {
  try {
    if (auto refused = RefuseUnseen(bytes, limits)) return *std::move(refused);
    return DecodeSeen(DecoderInProcess(), bytes, ReadPhotoHeader(bytes), limits, wanted);
  } catch (const std::exception&) {
    // Other failures of the libraries are handled where the libraries are called.
    return NoMemory({}, {});
  }
}

DecodedPhoto DecodePhoto(const PhotoDecoder& decoder, std::span<const uint8_t> bytes,
                         const PhotoHeader& header, const DecodeLimits& limits,
                         WantedPixels wanted) {
  try {
    if (auto refused = RefuseUnseen(bytes, limits)) return *std::move(refused);
    return DecodeSeen(decoder, bytes, header, limits, wanted);
  } catch (const std::exception&) {
    return NoMemory({}, {});
  }
}

}  // namespace veduta
