// A folder of frames, played at a steady pace as if they came from a camera just now.
#pragma once

#include <memory>

#include "services/camera_grabber/frame_source.hpp"
#include "services/camera_grabber/options.hpp"

namespace beckon {

// `options.path`: a sequence folder (sequence.toml beside frames/) or a folder with pictures (.jpg,
// .jpeg, .png), which are taken in the order of their names. The rate is options.rate_hz, else that
// of the sequence.toml, else 10 Hz. JPEG files pass through untouched. No frame is left out: when
// whoever fetches is late, the pace waits for it. Throws SourceError where there is no frame.
std::unique_ptr<FrameSource> OpenFolderSource(const PlaybackOptions& options, int jpeg_quality,
                                              const Clock& clock);

}  // namespace beckon
