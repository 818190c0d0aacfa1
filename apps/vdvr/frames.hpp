// Frames of a turntable that go into a folder: which of them this process draws, where several do (vdvr-mpi),
// and which an earlier run has left (--resume).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "apps/common/output_folder.hpp"
#include "vdvr/expert/crew.hpp"

namespace vdvr::cli {

/// "frame-0007.png".
std::string frame_name(std::int64_t frame);

struct FramesOptions {
  std::filesystem::path folder;
  std::int64_t frames = 1;
  bool force = false, resume = false;
  bool certificate = false;  ///< certificate.json comes last
  std::string key;           ///< all that decides the pictures: frames of another are not kept
};

struct FramesDrawn {
  std::int64_t drawn = 0;  ///< by this process
  std::int64_t kept = 0;   ///< of an earlier run
};

/// Calls draw(number, path) for each frame that is this process's to draw and is not there yet; of the leader
/// also for those that others were to draw and have not, because they are gone or gave no sign for long.
/// Then, of the leader, `finish` writes the certificate, where there is one. Until then `turntable.json` in
/// the folder says what is being drawn. Throws InputError for a folder that is in the way.
FramesDrawn draw_frames(const FramesOptions& options,
                        const std::function<void(std::int64_t, const std::filesystem::path&)>& draw,
                        const std::function<void(OutputFolder&)>& finish);

/// Of a process of vdvr-mpi that is not the leader: waits until that has made a folder for frames. False
/// where it will not.
bool wait_for_frames(Messenger& messenger);
/// From here on draw_frames() draws this process's frames alone.
void follow_frames(Messenger& messenger, int rank);
/// Tells the leader that this process has drawn what it can.
void end_frames(Messenger& messenger);

}  // namespace vdvr::cli
