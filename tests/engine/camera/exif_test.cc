// SPDX-License-Identifier: Apache-2.0
// Goal: what a camera says of itself and of where it was is read from a block of EXIF; what is
//   broken or senseless is as good as absent.
// Method: blocks that exiv2 writes, cut short and with flipped bytes.
#include "engine/camera/exif.h"

#include <gtest/gtest.h>

#include "engine/camera/decoder.h"
#include "tests/engine/camera/exif_writer.h"
#include "tests/engine/camera/tiff_writer.h"

namespace veduta {
namespace {

using testing::ExifOf;
using testing::FileBytes;

const ExifCamera kPhone{"Apple", "iPhone 12", "wide lens", 4.2, 1.5, 26, 4032, 3024};

TEST(Exif, IsReadAsItWasWritten) {
  EXPECT_EQ(ReadExifCamera(ExifOf(kPhone)), kPhone);
  EXPECT_EQ(ReadExifCamera(ExifOf({})), ExifCamera());
  EXPECT_EQ(ReadExifCamera({}), ExifCamera());
}

// Where no equivalent on film is told, as by many cameras of the years before 2010.
TEST(Exif, TheSensorsResolutionTellsTheEquivalentOnFilm) {
  const auto read = [](uint16_t unit, double per_unit, uint32_t pixels, double zoom = 0) {
    const Exiv2::URational resolution(static_cast<uint32_t>(std::lround(per_unit * 1000)), 1000);
    Exiv2::ExifData data;
    data["Exif.Photo.FocalLength"] = Exiv2::URational(50, 1);
    if (zoom > 0) data["Exif.Photo.DigitalZoomRatio"] = Exiv2::URational(3, 2);
    data["Exif.Photo.FocalPlaneResolutionUnit"] = unit;
    data["Exif.Photo.FocalPlaneXResolution"] = resolution;
    data["Exif.Photo.FocalPlaneYResolution"] = resolution;
    data["Exif.Photo.PixelXDimension"] = pixels;
    data["Exif.Photo.PixelYDimension"] = pixels * 2 / 3;
    return ReadExifCamera(testing::BlockOf(data)).focal_35mm;
  };
  // 3600 x 2400 px of 10 um: as large as film.
  EXPECT_NEAR(read(2, 2540, 3600), 50, 0.01);
  EXPECT_NEAR(read(3, 1000, 3600), 50, 0.01);
  EXPECT_NEAR(read(4, 100, 3600), 50, 0.01);
  EXPECT_NEAR(read(3, 2000, 3600), 100, 0.02);
  EXPECT_NEAR(read(3, 1000, 3600, 1.5), 75, 0.02);
  EXPECT_EQ(read(1, 1000, 3600), 0) << "in no unit";
  EXPECT_EQ(read(3, 0, 3600), 0);
  EXPECT_EQ(read(3, 1000, 0), 0);
  EXPECT_EQ(read(3, 100'000, 3600), 0) << "a sensor of 0.4 mm";
  EXPECT_EQ(read(3, 1, 3600), 0) << "a sensor of 36 m";
}

TEST(Exif, AKnownCamerasSensorTellsTheEquivalentOnFilm) {
  const auto read = [](const char* model, uint32_t width_px, uint32_t height_px) {
    Exiv2::ExifData data;
    data["Exif.Image.Make"] = "SONY";
    data["Exif.Image.Model"] = model;
    data["Exif.Photo.FocalLength"] = Exiv2::URational(63, 10);
    if (width_px > 0) data["Exif.Photo.PixelXDimension"] = width_px;
    if (width_px > 0) data["Exif.Photo.PixelYDimension"] = height_px;
    return ReadExifCamera(testing::BlockOf(data)).focal_35mm;
  };
  // 6.3 mm before 5.76 x 4.29 mm: its maker says 38 mm.
  EXPECT_NEAR(read("DSC-W55", 3072, 2304), 38, 0.2);
  EXPECT_NEAR(read("DSC-W55", 2304, 3072), 38, 0.2);
  EXPECT_NEAR(read("DSC-W55", 0, 0), 38, 0.1);
  // Wide photos are as wide as the sensor, and less high.
  EXPECT_NEAR(read("DSC-W55", 1920, 1080), 6.3 * 43.267 / (5.76 * 1.1474), 0.02);
  EXPECT_NEAR(read("DSC-W55", 2000, 2000), 6.3 * 43.267 / (4.29 * 1.4142), 0.02);
  EXPECT_EQ(read("DSC-W5500", 3072, 2304), 0);
}

TEST(Exif, SenselessTextsAndNumbersAreAbsent) {
  const ExifCamera read =
      ReadExifCamera(ExifOf({"  Maker  ", "a\x1b[31mb", std::string(65, 'x'), 20'000, 0, 20'001}));
  EXPECT_EQ(read, (ExifCamera{"Maker", "", "", 0, 0, 0}));
}

TEST(Exif, BrokenBlocksTellNothingOrSomething) {
  const FileBytes whole = ExifOf(kPhone);
  for (size_t size = 0; size < whole.size(); ++size) {
    const ExifCamera read = ReadExifCamera({whole.data(), size});
    EXPECT_TRUE(read.model.empty() || read.model == kPhone.model) << size;
  }
  for (size_t i = 0; i < whole.size(); ++i) {
    FileBytes flipped = whole;
    flipped[i] ^= 0xFF;
    const ExifCamera read = ReadExifCamera(flipped);
    EXPECT_LE(read.model.size(), 64u) << i;
    EXPECT_GE(read.focal_mm, 0) << i;
  }
}

// Tags and values as exiv2 takes them.
FileBytes GpsBlock(const std::vector<std::pair<const char*, const char*>>& changes) {
  Exiv2::ExifData data;
  const auto set = [&](const std::string& tag, const char* text) {
    const Exiv2::ExifKey key("Exif.GPSInfo." + tag);
    const auto found = data.findKey(key);
    if (found != data.end()) data.erase(found);
    if (*text == 0) return;
    const auto value = Exiv2::Value::create(key.defaultTypeId());
    value->read(text);
    data.add(key, value.get());
  };
  set("GPSLatitudeRef", "N");
  set("GPSLatitude", "47/1 4/1 1200/100");
  set("GPSLongitudeRef", "E");
  set("GPSLongitude", "15/1 26/1 24/1");
  set("GPSAltitudeRef", "0");
  set("GPSAltitude", "3535/10");
  set("GPSHPositioningError", "425/100");
  for (const auto& [tag, text] : changes) set(tag, text);
  return testing::BlockOf(data);
}

TEST(Exif, TellsWhereAPhotoWasTaken) {
  const auto fix = ReadExifGps(GpsBlock({}));
  ASSERT_TRUE(fix);
  EXPECT_NEAR(fix->latitude_deg, 47.07, 1e-12);
  EXPECT_NEAR(fix->longitude_deg, 15.44, 1e-12);
  EXPECT_EQ(fix->height_m, 353.5);
  EXPECT_EQ(fix->accuracy_m, 4.25);
  const auto south_west = ReadExifGps(GpsBlock({{"GPSLatitudeRef", "S"},
                                                {"GPSLongitudeRef", "W"},
                                                {"GPSAltitudeRef", "1"},
                                                {"GPSHPositioningError", ""}}));
  ASSERT_TRUE(south_west);
  EXPECT_NEAR(south_west->latitude_deg, -47.07, 1e-12);
  EXPECT_NEAR(south_west->longitude_deg, -15.44, 1e-12);
  EXPECT_EQ(south_west->height_m, -353.5);
  EXPECT_EQ(south_west->accuracy_m, 0);
  // Decimal minutes, or degrees alone.
  const auto minutes = ReadExifGps(GpsBlock({{"GPSLatitude", "47/1 42/10 0/0"}}));
  ASSERT_TRUE(minutes);
  EXPECT_NEAR(minutes->latitude_deg, 47.07, 1e-12);
  const auto large = ReadExifGps(GpsBlock(
      {{"GPSLatitude", "47/1 4/1 3000000000/100000000"}, {"GPSAltitude", "4000000000/10000000"}}));
  ASSERT_TRUE(large);
  EXPECT_NEAR(large->latitude_deg, 47 + 4 / 60.0 + 30 / 3600.0, 1e-12);
  EXPECT_EQ(large->height_m, 400);
  const auto degrees = ReadExifGps(GpsBlock({{"GPSLatitude", "4707/100"}, {"GPSAltitude", ""}}));
  ASSERT_TRUE(degrees);
  EXPECT_NEAR(degrees->latitude_deg, 47.07, 1e-12);
  EXPECT_EQ(degrees->height_m, std::nullopt);
}

TEST(Exif, TellsWhereTheCameraLooked) {
  const auto heading = [](const char* direction, const char* ref) {
    const auto fix =
        ReadExifGps(GpsBlock({{"GPSImgDirection", direction}, {"GPSImgDirectionRef", ref}}));
    EXPECT_TRUE(fix);
    return fix ? fix->heading_deg : std::nullopt;
  };
  EXPECT_EQ(heading("2715/10", "T"), 271.5);
  EXPECT_EQ(heading("0/1", "T"), 0);
  EXPECT_EQ(heading("360/1", "T"), 0);
  EXPECT_EQ(heading("2715/10", "M"), std::nullopt) << "the magnetic north may be 20 degrees off";
  EXPECT_EQ(heading("2715/10", ""), std::nullopt);
  EXPECT_EQ(heading("", "T"), std::nullopt);
  EXPECT_EQ(heading("361/1", "T"), std::nullopt);
  EXPECT_EQ(heading("5/0", "T"), std::nullopt);
  const FileBytes looked = GpsBlock({{"GPSImgDirection", "90/1"}, {"GPSImgDirectionRef", "T"}});
  const GpsFix fix = *ReadExifGps(looked);
  EXPECT_TRUE(HoldsExifGps(looked, fix));
  EXPECT_FALSE(HoldsExifGps(GpsBlock({}), fix));
  // An earlier program did not read it.
  EXPECT_TRUE(HoldsExifGps(looked, *ReadExifGps(GpsBlock({}))));
}

TEST(Exif, ATiffIsItsOwnBlock) {
  const FileBytes tiff = testing::TiffFile(testing::TestPicture(48, 32));
  const auto image = Exiv2::ImageFactory::open(tiff.data(), static_cast<long>(tiff.size()));
  image->readMetadata();
  Exiv2::ExifData data = image->exifData();
  data["Exif.Image.Make"] = "Maker";
  data["Exif.Image.Model"] = "Model";
  data["Exif.Photo.FocalLength"] = Exiv2::URational(42, 10);
  data["Exif.Photo.DateTimeOriginal"] = "2026:11:29 10:20:30";
  image->setExifData(data);
  image->writeMetadata();
  Exiv2::BasicIo& io = image->io();
  ASSERT_EQ(io.open(), 0);
  const Exiv2::DataBuf whole = io.read(static_cast<long>(io.size()));
  const FileBytes bytes(whole.pData_, whole.pData_ + whole.size_);
  const PhotoExamination found = DecoderInProcess().Examine(bytes);
  EXPECT_EQ(found.header.outcome, HeaderOutcome::kRead) << found.header.detail;
  EXPECT_EQ(found.camera.make, "Maker");
  EXPECT_EQ(found.camera.model, "Model");
  EXPECT_EQ(found.camera.focal_mm, 4.2);
  EXPECT_TRUE(found.taken);
  EXPECT_LE(ReadPhotoHeader(bytes).exif.size(), size_t{1} << 16);
  for (size_t size = 0; size < bytes.size(); size += 5) {
    const double focal_mm = DecoderInProcess().Examine({bytes.data(), size}).camera.focal_mm;
    EXPECT_TRUE(focal_mm == 0 || focal_mm == 4.2) << size;
  }
}

TEST(Exif, SenselessPlacesAreAbsent) {
  using Changes = std::vector<std::pair<const char*, const char*>>;
  for (const Changes& changes :
       {Changes{{"GPSLatitude", ""}}, Changes{{"GPSLongitude", ""}},
        Changes{{"GPSLatitudeRef", ""}}, Changes{{"GPSLongitudeRef", "X"}},
        Changes{{"GPSLatitude", "91/1 0/1 0/1"}}, Changes{{"GPSLongitude", "181/1 0/1 0/1"}},
        Changes{{"GPSLatitude", "47/0 4/1 12/1"}},
        Changes{{"GPSLatitude", "0/1 0/1 0/1"}, {"GPSLongitude", "0/1 0/1 0/1"}},
        Changes{{"GPSStatus", "V"}}, Changes{{"GPSMapDatum", "TOKYO"}},
        Changes{{"GPSMapDatum", "ED50"}}, Changes{{"GPSMapDatum", "NAD27"}},
        Changes{{"GPSHPositioningError", "10001/1"}},
        Changes{{"GPSHPositioningError", "4294967295/1"}}})
    EXPECT_FALSE(ReadExifGps(GpsBlock(changes)));
  for (const char* datum : {"WGS-84", "WGS84", "WGS 84   ", "wgs-84", "JGD2000", "ETRS89"})
    EXPECT_TRUE(ReadExifGps(GpsBlock({{"GPSMapDatum", datum}}))) << datum;
  EXPECT_EQ(ReadExifGps(GpsBlock({{"GPSHPositioningError", "10000/1"}}))->accuracy_m, 10'000);
  // What a database holds by an earlier program is what its photo says.
  const GpsFix tokyo = *ReadExifGps(GpsBlock({}));
  for (const char* datum : {"TOKYO", "WGS-84"})
    EXPECT_TRUE(HoldsExifGps(GpsBlock({{"GPSMapDatum", datum}}), tokyo)) << datum;
  EXPECT_FALSE(HoldsExifGps(GpsBlock({{"GPSAltitude", ""}}), tokyo));
  EXPECT_FALSE(HoldsExifGps({}, tokyo));
  EXPECT_FALSE(ReadExifGps({}));
  EXPECT_FALSE(ReadExifGps(ExifOf(kPhone)));
  // A height that is none does not take the rest along.
  const auto fix = ReadExifGps(GpsBlock({{"GPSAltitude", "5/0"}}));
  ASSERT_TRUE(fix);
  EXPECT_EQ(fix->height_m, std::nullopt);
}

TEST(Exif, BrokenPlacesAreOnTheEarth) {
  const FileBytes whole = GpsBlock({});
  for (size_t i = 0; i < whole.size(); ++i) {
    FileBytes flipped = whole;
    flipped[i] ^= 0xFF;
    for (const auto& fix : {ReadExifGps(flipped), ReadExifGps({whole.data(), i})}) {
      if (!fix) continue;
      EXPECT_LE(std::abs(fix->latitude_deg), 90) << i;
      EXPECT_LE(std::abs(fix->longitude_deg), 180) << i;
      EXPECT_LE(std::abs(fix->height_m.value_or(0)), 10'000) << i;
      EXPECT_GE(fix->accuracy_m, 0) << i;
    }
  }
}

FileBytes TimeBlock(const char* time, const char* offset) {
  Exiv2::ExifData data;
  if (*time != 0) data["Exif.Photo.DateTimeOriginal"] = time;
  if (*offset != 0) data["Exif.Photo.OffsetTimeOriginal"] = offset;
  data["Exif.Image.DateTime"] = "2001:02:03 04:05:06";  // when it was changed
  return testing::BlockOf(data);
}

TEST(Exif, TellsWhenAPhotoWasTaken) {
  const auto told = ReadExifTaken(TimeBlock("2023:11:14 22:13:20", "+05:30"));
  ASSERT_TRUE(told);
  EXPECT_EQ(told->local_unix_s, 1'700'000'000);
  EXPECT_EQ(told->offset_s, 19'800);
  EXPECT_EQ(ReadExifTaken(TimeBlock("2024:02:29 00:00:00", "-09:00"))->offset_s, -32'400);
  for (const char* offset : {"", "Z", "+5:30", "+15:00", "-12:30", "+01:60", "01:00", "+01:00x"})
    EXPECT_EQ(ReadExifTaken(TimeBlock("2023:11:14 22:13:20", offset)),
              (TakenTime{1'700'000'000, std::nullopt}))
        << offset;
}

TEST(Exif, ATimeThatThereIsNotIsAbsent) {
  for (const char* time : {"", "0000:00:00 00:00:00", "    :  :     :  :  ", "2023:02:29 00:00:00",
                           "2023:13:01 00:00:00", "2023:11:14 24:00:00", "2023:11:14 22:60:00",
                           "2023:11:14 22:13:60", "2023-11-14 22:13:20", "2023:11:14T22:13:20",
                           "2023:11:14 22:13", "2023:11:14 22:13:20.5", "1825:12:31 23:59:59"})
    EXPECT_FALSE(ReadExifTaken(TimeBlock(time, "+01:00"))) << time;
  EXPECT_FALSE(ReadExifTaken({}));
  const FileBytes whole = TimeBlock("2023:11:14 22:13:20", "+05:30");
  for (size_t i = 0; i < whole.size(); ++i) {
    FileBytes flipped = whole;
    flipped[i] ^= 0xFF;
    for (const auto& told : {ReadExifTaken(flipped), ReadExifTaken({whole.data(), i})}) {
      if (!told) continue;
      EXPECT_GE(told->local_unix_s, kTakenUnixSMin) << i;
      EXPECT_LE(told->local_unix_s, kTakenUnixSMax) << i;
    }
  }
}

}  // namespace
}  // namespace veduta
