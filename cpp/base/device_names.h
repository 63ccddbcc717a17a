// SPDX-License-Identifier: MIT
// Names for headers that may not include CUDA.
#pragma once

namespace sdftrack {

class DeviceStream;  // device_stream.h

}  // namespace sdftrack
