// The front door: a scan and a tolerance in; a certified volume, its verification, pictures with what is
// certain of them, and files for other programs out. `vdvr/expert/` has the parts that these are made of.
#pragma once

#include "vdvr/api.hpp"
#include "vdvr/automatic_view.hpp"
#include "vdvr/certified_picture.hpp"
#include "vdvr/certify_scan.hpp"
#include "vdvr/device.hpp"
#include "vdvr/error.hpp"
#include "vdvr/export_volume.hpp"
#include "vdvr/raycast.hpp"
#include "vdvr/read_scan.hpp"
#include "vdvr/vdvr_file.hpp"
#include "vdvr/verify_file.hpp"
