// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sensor_sizes.h"

#include <algorithm>
#include <string>

namespace veduta {
namespace {

struct CamerasOfOneSensor {
  std::string_view make;
  SensorSize size;
  std::string_view models;  // between spaces, in small letters; | is a space within a name
};

// The sensors' usual names are those of camera tubes: a sensor of 1/2.5" measures 5.76 x 4.29 mm.
// Which camera has which is public knowledge. Cameras that write what is needed themselves (Canon's
// and Nikon's reflex cameras, telephones since 2015) are not here.
constexpr SensorSize kInch1Over4{3.6, 2.7}, kInch1Over3p2{4.54, 3.42}, kInch1Over3p06{4.69, 3.52},
    kInch1Over2p7{5.33, 4.0}, kInch1Over2p5{5.76, 4.29}, kInch1Over2p4{5.9, 4.43},
    kInch1Over2p3{6.17, 4.55}, kInch1Over1p8{7.18, 5.32}, kInch1Over1p7{7.53, 5.64},
    kInch2Over3{8.8, 6.6}, kFourThirds{17.3, 13.0};

constexpr CamerasOfOneSensor kTable[] = {
    {"apple", kInch1Over4, " iphone|3gs "},
    {"apple", kInch1Over3p2, " iphone|4 iphone|4s iphone|5 "},
    {"lge", kInch1Over4, " nexus|4 "},
    {"lge", kInch1Over3p2, " nexus|5 "},
    {"htc", {5.38, 3.04}, " one "},
    {"nokia", kInch1Over2p5, " n82 n95 n95|8gb "},
    {"samsung", kInch1Over3p2, " gt-i9100 gt-i9300 gt-i9305 gt-n7000 gt-n7100 gt-n7105 "},
    {"samsung", kInch1Over3p06, " gt-i9500 gt-i9505 sgh-i337 sgh-m919 sm-n900 sm-n9005 "},
    {"samsung", {5.95, 3.35}, " sm-g900a sm-g900f sm-g900i sm-g900t sm-g900v "},
    {"sony", kInch1Over2p7,
     " dsc-l1 dsc-p2 dsc-p8 dsc-p20 dsc-p30 dsc-p31 dsc-p32 dsc-p41 dsc-p43 dsc-p50 dsc-p51 dsc-p52"
     " dsc-p73 dsc-s30 dsc-s40 dsc-s50 dsc-s60 dsc-s80 dsc-s90 dsc-u10 dsc-u20 dsc-u30 dsc-u40"
     " dsc-u50 dsc-u60 "},
    {"sony", kInch1Over2p5,
     " dsc-g1 dsc-h1 dsc-h2 dsc-h3 dsc-h5 dsc-h7 dsc-h9 dsc-h10 dsc-m2 dsc-s45 dsc-s600 dsc-s650"
     " dsc-s700 dsc-s730 dsc-s750 dsc-s780 dsc-t2 dsc-t5 dsc-t9 dsc-t10 dsc-t20 dsc-t30 dsc-t50"
     " dsc-t70 dsc-t100 dsc-t200 dsc-w30 dsc-w35 dsc-w40 dsc-w50 dsc-w55 dsc-w70 dsc-w80 dsc-w85"
     " dsc-w90 dsc-w110 dsc-w115 dsc-w120 dsc-w125 dsc-w130 dsc-w150 "},
    {"sony", kInch1Over2p4,
     " dsc-f88 dsc-hx1 dsc-hx5 dsc-hx5v dsc-m1 dsc-t1 dsc-t3 dsc-t7 dsc-t11 dsc-t33 dsc-tx1 dsc-tx5"
     " dsc-tx7 dsc-wx1 "},
    {"sony", kInch1Over2p3,
     " dsc-g3 dsc-h20 dsc-h50 dsc-h55 dsc-h70 dsc-h90 dsc-h100 dsc-h200 dsc-hx7v dsc-hx9v dsc-hx10v"
     " dsc-hx20v dsc-hx30v dsc-hx50 dsc-hx100v dsc-hx200v dsc-hx300 dsc-s930 dsc-s950 dsc-s980"
     " dsc-s2000 dsc-s2100 dsc-s5000 dsc-t77 dsc-t90 dsc-t99 dsc-t110 dsc-t300 dsc-t500 dsc-t700"
     " dsc-t900 dsc-tx9 dsc-tx10 dsc-tx20 dsc-tx30 dsc-tx55 dsc-tx66 dsc-tx100v dsc-tx200v dsc-w170"
     " dsc-w180 dsc-w190 dsc-w210 dsc-w215 dsc-w220 dsc-w230 dsc-w275 dsc-w290 dsc-w310 dsc-w320"
     " dsc-w330 dsc-w350 dsc-w360 dsc-w370 dsc-w380 dsc-w510 dsc-w520 dsc-w530 dsc-w550 dsc-w560"
     " dsc-w570 dsc-w580 dsc-w610 dsc-w620 dsc-w630 dsc-w650 dsc-w670 dsc-w690 dsc-w710 dsc-w730"
     " dsc-wx5 dsc-wx7 dsc-wx9 dsc-wx10 dsc-wx30 dsc-wx50 dsc-wx60 dsc-wx70 dsc-wx80 dsc-wx100"
     " dsc-wx150 dsc-wx200 dsc-wx300 "},
    {"sony", kInch1Over1p8,
     " cd300 cd400 cd500 dsc-f55v dsc-f77 dsc-f505v dsc-n1 dsc-p1 dsc-p3 dsc-p5 dsc-p7 dsc-p9"
     " dsc-p10 dsc-p12 dsc-p71 dsc-p72 dsc-p92 dsc-p93 dsc-p100 dsc-p120 dsc-p150 dsc-p200 dsc-s70"
     " dsc-s75 dsc-s85 dsc-s800 dsc-v1 dsc-v3 dsc-w1 dsc-w5 dsc-w7 dsc-w12 dsc-w17 dsc-w100 "},
    {"sony", kInch1Over1p7, " dsc-n2 dsc-w200 dsc-w270 dsc-w300 "},
    {"sony", kInch2Over3, " dsc-f707 dsc-f717 dsc-f828 "},
    {"olympus", kInch1Over2p7, " c700uz c730uz c750uz c2z,d520z,c220z "},
    {"olympus", kInch1Over1p8, " c3000z c3030z c3040z c4000z c4040z c5050z c5060wz "},
    {"olympus", kInch2Over3, " c8080wz e-10 e-20 "},
    {"olympus", kFourThirds,
     " e-1 e-3 e-5 e-30 e-300 e-330 e-400 e-410 e-420 e-450 e-500 e-510 e-520 e-600 e-620 "},
};

// The makers of cameras call themselves "SONY", "NOKIA", "OLYMPUS IMAGING CORP.".
std::string SmallLetters(std::string_view text) {
  std::string small(text);
  for (char& c : small)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return small;
}

}  // namespace

std::optional<SensorSize> FindSensorSize(std::string_view make, std::string_view model) {
  const std::string maker = SmallLetters(make);
  std::string wanted = SmallLetters(model);
  std::replace(wanted.begin(), wanted.end(), ' ', '|');
  for (const CamerasOfOneSensor& cameras : kTable) {
    if (!maker.starts_with(cameras.make)) continue;
    std::string name = wanted;
    if (name.starts_with(std::string(cameras.make) + '|')) name.erase(0, cameras.make.size() + 1);
    if (!name.empty() && cameras.models.find(' ' + name + ' ') != std::string_view::npos)
      return cameras.size;
  }
  return std::nullopt;
}

}  // namespace veduta
