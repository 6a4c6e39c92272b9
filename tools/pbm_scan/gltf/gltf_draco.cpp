#include "pbm_scan/gltf/gltf_draco.h"

#include "pbm_scan/surface/refusal.h"
#include "system/processes/child_process.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

namespace pbm::build {
namespace {

// Sent first by the child.
struct Head {
    std::uint64_t vertices = 0, corners = 0;
};
constexpr std::uint64_t kMaxNumbers = std::uint64_t{1} << 31;

template <class T> void send_all(const std::vector<T> &values, const ByteSink &send) {
    send({reinterpret_cast<const std::uint8_t *>(values.data()), values.size() * sizeof(T)});
}

float largest_of(draco::DataType type) {
    switch (type) {
    case draco::DT_INT8: return 127;
    case draco::DT_UINT8: return 255;
    case draco::DT_INT16: return 32767;
    case draco::DT_UINT16: return 65535;
    default: return 1;
    }
}

// In the child.
Status decode_and_send(ByteView bytes, std::span<const DracoRequest> requests, const ByteSink &send) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char *>(bytes.data()), bytes.size());
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    const auto refuse = [](const char *why) {
        return bad_input(std::string("its compressed bytes (Draco) are damaged: ") + why + "; export it again");
    };
    if (!type.ok())
        return refuse("no geometry");
    draco::Decoder decoder;
    std::unique_ptr<draco::PointCloud> cloud;
    Head head;
    std::vector<std::uint32_t> corners;
    if (type.value() == draco::TRIANGULAR_MESH) {
        auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
        if (!mesh.ok())
            return refuse("no mesh");
        for (draco::FaceIndex face(0); face < mesh.value()->num_faces(); ++face)
            for (const draco::PointIndex &corner : mesh.value()->face(face))
                corners.push_back(corner.value());
        cloud = std::move(mesh).value();
    } else {
        auto points = decoder.DecodePointCloudFromBuffer(&buffer);
        if (!points.ok())
            return refuse("no points");
        cloud = std::move(points).value();
    }
    head = {cloud->num_points(), corners.size()};
    send({reinterpret_cast<const std::uint8_t *>(&head), sizeof head});
    send_all(corners, send);
    for (const DracoRequest &request : requests) {
        const draco::PointAttribute *const attribute = cloud->GetAttributeByUniqueId(request.id);
        if (attribute == nullptr)
            return refuse("an attribute is missing");
        const float scale =
            request.is_normalised && !attribute->normalized() ? 1 / largest_of(attribute->data_type()) : 1;
        std::vector<float> values(head.vertices * request.components, 1.0F);
        std::array<float, 4> value{};
        const auto used =
            std::min<std::uint32_t>(request.components, static_cast<std::uint32_t>(attribute->num_components()));
        for (draco::PointIndex i(0); i < cloud->num_points(); ++i) {
            attribute->ConvertValue<float>(attribute->mapped_index(i), static_cast<std::int8_t>(used), value.data());
            for (std::uint32_t k = 0; k < used; ++k)
                values[std::size_t{i.value()} * request.components + k] = value[k] * scale;
        }
        send_all(values, send);
    }
    return {};
}

} // namespace

Result<DracoMesh> decode_draco(ByteView bytes, std::span<const DracoRequest> requests) {
    // Data of the child is untrusted.
    Bytes received;
    const auto astray = [] { return bad_input("the Draco decoder went astray in this file; export it without Draco"); };
    std::uint64_t expected = sizeof(Head);
    Head head;
    const auto receive = [&](ByteView part) -> Status {
        received.insert(received.end(), part.begin(), part.end());
        if (expected == sizeof(Head) && received.size() >= sizeof(Head)) {
            std::memcpy(&head, received.data(), sizeof head);
            std::uint64_t numbers = head.corners;
            if (head.vertices > kMaxNumbers || head.corners > kMaxNumbers)
                return astray();
            for (const DracoRequest &request : requests)
                numbers += head.vertices * request.components;
            expected = sizeof(Head) + 4 * numbers;
        }
        return received.size() > expected ? Status(astray()) : Status();
    };
    const ChildTask task{.name = "the Draco decoder",
                         .advice = "export the scan without Draco",
                         .limits = {.cpu_seconds = 120, .wall_seconds = 480, .memory = std::uint64_t{4} << 30},
                         .work = [&](const ByteSink &send) { return decode_and_send(bytes, requests, send); },
                         .receive = receive};
    if (Status done = run_in_child(task); !done)
        return done.error();
    if (received.size() != expected || head.corners % 3 != 0)
        return astray();
    DracoMesh mesh{.vertices = head.vertices, .corners = {}, .attributes = {}};
    const std::uint8_t *at = received.data() + sizeof head;
    const auto take = [&at](auto &values, std::uint64_t count) {
        values.resize(count);
        if (count != 0)
            std::memcpy(values.data(), at, 4 * count);
        at += 4 * count;
    };
    take(mesh.corners, head.corners);
    for (const DracoRequest &request : requests)
        take(mesh.attributes.emplace_back(), head.vertices * request.components);
    return mesh;
}

} // namespace pbm::build
