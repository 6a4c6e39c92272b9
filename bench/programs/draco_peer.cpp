#include "draco_peer.h"

#include <draco/compression/decode.h>

namespace pbm::bench {

std::uint64_t decode_draco(ByteView file) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char *>(file.data()), file.size());
    draco::Decoder decoder;
    const auto cloud = decoder.DecodePointCloudFromBuffer(&buffer);
    return cloud.ok() ? cloud.value()->num_points() : 0;
}

} // namespace pbm::bench
