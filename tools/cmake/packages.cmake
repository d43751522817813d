# SPDX-License-Identifier: Apache-2.0
# The libraries of others that Veduta is built with; tools/packages names their Debian packages.
# A library that brings no CMake package of its own gets a target here, so that each target can say
# what it uses, and tests/tidy/includes_test.py can check that it does.

# Ceres comes before RocksDB: RocksDB's package hides the gflags target that Ceres wants.
find_package(Ceres 2.1 REQUIRED)
find_package(RocksDB REQUIRED CONFIG)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4 REQUIRED COMPONENTS core imgproc imgcodecs features2d calib3d)
find_package(opengv REQUIRED)
find_package(embree 3 REQUIRED)
find_package(OpenCL REQUIRED)
find_package(CapnProto REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(TIFF REQUIRED)
find_package(exiv2 REQUIRED)
find_package(PNG REQUIRED)
find_package(PROJ REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(OpenMesh REQUIRED)
find_package(tinyxml2 REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(Threads REQUIRED)
find_package(GTest REQUIRED)
find_package(Python3 REQUIRED COMPONENTS Interpreter)

# Makes the target NAME::NAME from a header and a library, each of which must be found.
function(veduta_imported_library name header library)
  find_path(${name}_INCLUDE ${header} REQUIRED)
  find_library(${name}_LIBRARY ${library} REQUIRED)
  add_library(${name}::${name} INTERFACE IMPORTED GLOBAL)
  target_include_directories(${name}::${name} SYSTEM INTERFACE ${${name}_INCLUDE})
  target_link_libraries(${name}::${name} INTERFACE ${${name}_LIBRARY})
endfunction()

veduta_imported_library(turbojpeg turbojpeg.h turbojpeg)
veduta_imported_library(GeographicLib GeographicLib/LocalCartesian.hpp GeographicLib)
veduta_imported_library(sodium sodium.h sodium)
veduta_imported_library(hpdf hpdf.h hpdf)
veduta_imported_library(heif libheif/heif.h heif)
veduta_imported_library(de265 libde265/de265.h de265)
veduta_imported_library(webp webp/decode.h webp)
veduta_imported_library(seccomp seccomp.h seccomp)
veduta_imported_library(jemalloc jemalloc/jemalloc.h jemalloc)
# Writes EXIF into WebP, for tests alone.
veduta_imported_library(webpmux webp/mux.h webpmux)
# FLANN is used by its headers alone, and they want lz4.
veduta_imported_library(flann flann/flann.hpp lz4)
