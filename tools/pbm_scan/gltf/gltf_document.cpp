#include "pbm_scan/gltf/gltf_document.h"

#include "pbm_scan/images/files_beside.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/stand_in.h"
#include "pbm_scan/text/text_lines.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

namespace pbm::build {
namespace {

// Accessors without data, and decompressed views, may claim this much more than the file has bytes.
constexpr std::size_t kFreeElements = std::size_t{1} << 24;

std::size_t size_of_type(int type) {
    switch (type) {
    case 5120:
    case 5121: return 1;
    case 5122:
    case 5123: return 2;
    case 5125:
    case 5126: return 4;
    default: return 0;
    }
}

std::size_t components_of(const std::string &type) {
    constexpr std::array<std::pair<std::string_view, std::size_t>, 7> kTypes{
        {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
    for (const auto &[name, count] : kTypes)
        if (name == type)
            return count;
    return 0;
}

template <class T> float scalar(const std::uint8_t *at, bool is_normalised) {
    const auto value = load<T>(at);
    if constexpr (std::is_same_v<T, float>)
        return value;
    else if (is_normalised)
        return std::max(static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max()), -1.0F);
    else
        return static_cast<float>(value);
}

using ScalarReader = float (*)(const std::uint8_t *, bool);
ScalarReader reader_of(int type) {
    switch (type) {
    case 5120: return scalar<std::int8_t>;
    case 5121: return scalar<std::uint8_t>;
    case 5122: return scalar<std::int16_t>;
    case 5123: return scalar<std::uint16_t>;
    case 5125: return scalar<std::uint32_t>;
    default: return scalar<float>;
    }
}

std::uint32_t whole(const std::uint8_t *at, int type) {
    if (size_of_type(type) == 1)
        return *at;
    return size_of_type(type) == 2 ? load<std::uint16_t>(at) : load<std::uint32_t>(at);
}

std::string name_of(const char *array, std::size_t index) {
    const bool is_index = index != ~std::size_t{0}; // else damaged (index_of)
    return std::string(array) + "[" + (is_index ? std::to_string(index) : "?") + "]";
}

std::vector<AttributeReport> report_of(const GltfChunks &chunks) {
    std::vector<AttributeReport> report;
    report_trailing(report, chunks.bytes_behind, "behind the GLB file");
    if (chunks.has_further)
        drop_once(report, "further chunks", "not known to glTF 2");
    if (chunks.is_miscounted)
        report.push_back({"chunks", Fate::converted, "the length of one leaves out the bytes that fill it"});
    return report;
}

// The filter COLOR of KHR_meshopt_compression: luma and two chroma components, of as many bits as the highest one of
// the fourth component says, to red, green, blue and opacity. `T`: the type of a component, `Signed`: with a sign.
template <class T, class Signed> void decode_colours(std::vector<std::uint8_t> &bytes) {
    constexpr int kMax = std::numeric_limits<T>::max();
    for (std::size_t at = 0; at + 4 * sizeof(T) <= bytes.size(); at += 4 * sizeof(T)) {
        auto values = load<std::array<T, 4>>(bytes.data() + at);
        const int scale = std::max(static_cast<int>(std::bit_ceil(values[3] + 1U)) - 1, 1);
        const int y = values[0];
        const int co = int{static_cast<Signed>(values[1])}; // NOLINT(bugprone-signed-char-misuse): a number with a sign
        const int cg = int{static_cast<Signed>(values[2])}; // NOLINT(bugprone-signed-char-misuse)
        const int opacity = ((values[3] << 1) & scale) | (values[3] & 1);
        const std::array<int, 4> colour{y + co - cg, y + cg, y - co - cg, opacity};
        for (std::size_t i = 0; i < 4; ++i)
            values[i] = static_cast<T>(std::clamp(
                (static_cast<double>(colour[i]) * kMax) / static_cast<double>(scale) + 0.5, 0.0, double{kMax}));
        std::memcpy(bytes.data() + at, values.data(), sizeof values);
    }
}

} // namespace

std::optional<NamedFile> file_of_uri(const std::string &scan, const std::string &uri) {
    if (scan.empty() || uri.empty() || is_data_uri(uri))
        return std::nullopt;
    NamedFile named = name_beside(scan, without_percents(uri));
    named.name = uri;
    if (named.file.empty())
        named.file = find_beside(scan, uri).value_or("");
    return named;
}

Result<GltfDocument> GltfDocument::open(const ScanFile &file) {
    const Result<GltfChunks> chunks = gltf_chunks(file.bytes);
    if (!chunks)
        return chunks.error();
    const ByteView json = chunks->json;
    if (json.size() > kMaxGltfJson)
        return too_large("more than 256 MiB of JSON; export the scan as GLB");
    try {
        Json parsed = Json::parse(json.begin(), json.end());
        const std::string version = text_of(member(&parsed, "asset"), "version");
        if (!parsed.is_object() || version.empty())
            return bad_input("no glTF file: its JSON has no asset with a version");
        if (version.starts_with("1"))
            return Error{ErrorCode::unsupported_version, 0, "glTF 1; export it as glTF 2"};
        GltfDocument document(std::move(parsed), chunks->binary, file.path, file.bytes.size());
        document.report_ = report_of(*chunks);
        return document;
    } catch (const Json::parse_error &error) {
        const auto start = static_cast<std::size_t>(json.data() - file.bytes.data());
        return bad_input("the JSON of the glTF file is damaged; export it again",
                         start + std::min<std::size_t>(error.byte, json.size()));
    } catch (const Json::exception &) {
        return bad_input("the JSON of the glTF file is damaged; export it again");
    }
}

Result<GltfResource> GltfDocument::resource(const std::string &uri) const {
    if (is_data_uri(uri))
        return read_data_uri(uri);
    const auto named = file_of_uri(path_, uri);
    if (!named || named->file.empty())
        return bad_input("there is no file " + printable_in_quotes(uri) + " beside the scan" +
                         (uri.find("<UDIM>") != std::string::npos ? ": " + why_missing(uri) : ""));
    Result<MappedFile> file = MappedFile::open(named->file);
    if (!file)
        return file.error();
    return GltfResource{.file = std::move(*file)};
}

Result<ByteView> GltfDocument::buffer(std::size_t index) {
    const Json *const described = item(root("buffers"), index);
    if (described == nullptr)
        return bad_input(name_of("buffers", index) + " does not exist");
    const Json *const uri = member(described, "uri");
    ByteView bytes = binary_;
    if (uri != nullptr && uri->is_string() && !uri->get_ref<const std::string &>().empty()) {
        auto known = resources_.find(index);
        if (known == resources_.end()) {
            Result<GltfResource> read = resource(uri->get_ref<const std::string &>());
            if (!read)
                return bad_input(name_of("buffers", index) + ": " + read.error().message);
            further_bytes_ += read->bytes().size();
            known = resources_.emplace(index, std::move(*read)).first;
        }
        bytes = known->second.bytes();
    }
    const std::size_t length = index_of(described, "byteLength").value_or(0);
    if (const auto instead = stand_in(as_text(bytes)))
        return bad_input(name_of("buffers", index) + ": the file is " + *instead);
    if (length > bytes.size())
        return bad_input(name_of("buffers", index) + " announces " + std::to_string(length) + " bytes and has " +
                         std::to_string(bytes.size()) + ": it is cut short; copy or export it again");
    return bytes.first(length);
}

Result<GltfDocument::View> GltfDocument::decompressed(const Json &extension, std::size_t index) {
    const std::string name = name_of("bufferViews", index);
    const Result<ByteView> from = buffer(index_of(&extension, "buffer").value_or(~std::size_t{0}));
    if (!from)
        return from.error();
    const std::size_t offset = index_of(&extension, "byteOffset").value_or(0),
                      length = index_of(&extension, "byteLength").value_or(0),
                      stride = index_of(&extension, "byteStride").value_or(0),
                      count = index_of(&extension, "count").value_or(0);
    const std::string mode = text_of(&extension, "mode"), filter = text_of(&extension, "filter");
    if (offset > from->size() || length > from->size() - offset)
        return bad_input(name + " goes beyond the end of its buffer");
    // The codec packs 64 bytes into one at best.
    constexpr std::size_t kMaxPacked = 64, kMaxStride = 256;
    if (stride == 0 || stride > kMaxStride || count > (kMaxPacked * length + kFreeElements) / stride)
        return bad_input(name + " announces more elements than its compressed bytes can hold");
    auto known = decompressed_.find(index);
    if (known == decompressed_.end()) {
        unpacked_ += count * stride;
        if (unpacked_ > kFreeElements + kMaxPacked * bytes())
            return too_large("compressed buffer views hold many more bytes than the file; export it uncompressed");
        std::vector<std::uint8_t> out(count * stride);
        const std::uint8_t *const packed = from->data() + offset;
        int failed = -1;
        if (mode == "ATTRIBUTES" && stride % 4 == 0)
            failed = meshopt_decodeVertexBuffer(out.data(), count, stride, packed, length);
        else if (mode == "TRIANGLES" && (stride == 2 || stride == 4) && count % 3 == 0)
            failed = meshopt_decodeIndexBuffer(out.data(), count, stride, packed, length);
        else if (mode == "INDICES" && (stride == 2 || stride == 4))
            failed = meshopt_decodeIndexSequence(out.data(), count, stride, packed, length);
        if (failed != 0)
            return bad_input(name + ": its compressed bytes (EXT_meshopt_compression) are damaged; export it again");
        if (filter == "OCTAHEDRAL" && (stride == 4 || stride == 8))
            meshopt_decodeFilterOct(out.data(), count, stride);
        else if (filter == "QUATERNION" && stride == 8)
            meshopt_decodeFilterQuat(out.data(), count, stride);
        else if (filter == "EXPONENTIAL" && stride % 4 == 0)
            meshopt_decodeFilterExp(out.data(), count, stride);
        else if (filter == "COLOR" && (stride == 4 || stride == 8))
            stride == 4 ? decode_colours<std::uint8_t, std::int8_t>(out)
                        : decode_colours<std::uint16_t, std::int16_t>(out);
        else if (!filter.empty() && filter != "NONE")
            return bad_input(name + ": the filter " + printable_in_quotes(filter) + " is not known");
        known = decompressed_.emplace(index, std::move(out)).first;
    }
    return View{known->second, stride};
}

Result<GltfDocument::View> GltfDocument::view(std::size_t index) {
    const Json *const described = item(root("bufferViews"), index);
    if (described == nullptr)
        return bad_input(name_of("bufferViews", index) + " does not exist");
    const Json *const extensions = member(described, "extensions");
    for (const char *name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
        if (const Json *const compression = member(extensions, name))
            return decompressed(*compression, index);
    const Result<ByteView> from = buffer(index_of(described, "buffer").value_or(~std::size_t{0}));
    if (!from)
        return from.error();
    const std::size_t offset = index_of(described, "byteOffset").value_or(0),
                      length = index_of(described, "byteLength").value_or(0);
    if (offset > from->size() || length > from->size() - offset)
        return bad_input(name_of("bufferViews", index) + " goes beyond the end of its buffer; export the scan again");
    return View{from->subspan(offset, length), index_of(described, "byteStride").value_or(0)};
}

Result<ByteView> GltfDocument::part(std::size_t index, std::size_t offset, std::size_t bytes, const std::string &what) {
    const Result<View> found = view(index);
    if (!found)
        return found.error();
    if (offset > found->bytes.size() || bytes > found->bytes.size() - offset)
        return bad_input(what + " goes beyond the end of " + name_of("bufferViews", index) + "; export the scan again");
    return found->bytes.subspan(offset, bytes);
}

std::size_t GltfDocument::count(std::size_t accessor) const {
    return index_of(item(root("accessors"), accessor), "count").value_or(0);
}
bool GltfDocument::is_normalised(std::size_t accessor) const {
    return is_true(member(item(root("accessors"), accessor), "normalized"));
}
int GltfDocument::component_type(std::size_t accessor) const {
    return static_cast<int>(
        std::min<std::size_t>(index_of(item(root("accessors"), accessor), "componentType").value_or(0), 65535));
}

Result<GltfDocument::Elements> GltfDocument::elements(std::size_t accessor) {
    const std::string name = name_of("accessors", accessor);
    const Json *const described = item(root("accessors"), accessor);
    if (described == nullptr)
        return bad_input(name + " does not exist");
    Elements out{.bytes = {},
                 .count = count(accessor),
                 .components = components_of(text_of(described, "type")),
                 .type = component_type(accessor),
                 .is_normalised = is_normalised(accessor)};
    const std::size_t size = out.components * size_of_type(out.type);
    if (size == 0)
        return bad_input(name + " has no type that glTF knows");
    const auto of_view = index_of(described, "bufferView");
    out.stride = size;
    if (!of_view) {
        if (out.count > kFreeElements + size_)
            return bad_input(name + " announces " + std::to_string(out.count) + " elements without data");
        return out;
    }
    const Result<View> found = view(*of_view);
    if (!found)
        return found.error();
    const std::size_t offset = index_of(described, "byteOffset").value_or(0);
    out.stride = found->stride != 0 ? found->stride : size;
    if (out.stride < size || out.stride > 65536)
        return bad_input(name_of("bufferViews", *of_view) + " has a stride that does not fit " + name);
    if (out.count == 0)
        return out;
    const std::size_t most = offset < found->bytes.size() && found->bytes.size() - offset >= size
                                 ? (found->bytes.size() - offset - size) / out.stride + 1
                                 : 0;
    if (out.count > most)
        return bad_input(name + " announces " + std::to_string(out.count) + " elements, but its buffer view holds " +
                         std::to_string(most) + ": the file is cut short or damaged; export it again");
    out.bytes = found->bytes.subspan(offset, (out.count - 1) * out.stride + size);
    return out;
}

Status GltfDocument::verify(std::size_t accessor) {
    const Result<Elements> found = elements(accessor);
    return found ? Status() : Status(found.error());
}

Result<std::vector<float>> GltfDocument::floats(std::size_t accessor, std::size_t components, float filled) {
    const Result<Elements> from = elements(accessor);
    if (!from)
        return from.error();
    // Of compressed views a byte holds many numbers, and several accessors may share bytes.
    constexpr std::uint64_t kFreeNumbers = std::uint64_t{1} << 26, kNumbersPerByte = 64;
    numbers_ += from->count * components;
    if (numbers_ > kFreeNumbers + kNumbersPerByte * bytes())
        return too_large("accessors want many more numbers than the file has bytes; export fewer");
    std::vector<float> values(from->count * components, filled);
    const std::size_t used = std::min(components, from->components), size = size_of_type(from->type);
    const ScalarReader read = reader_of(from->type);
    if (from->bytes.empty()) {
        for (std::size_t i = 0; i < from->count; ++i)
            std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(i * components), used, 0.0F);
    } else if (from->type == 5126) {
        for (std::size_t i = 0; i < from->count; ++i)
            std::memcpy(&values[i * components], from->bytes.data() + i * from->stride, 4 * used);
    } else {
        for (std::size_t i = 0; i < from->count; ++i)
            for (std::size_t k = 0; k < used; ++k)
                values[i * components + k] =
                    read(from->bytes.data() + i * from->stride + k * size, from->is_normalised);
    }
    if (const Status changed = for_sparse(accessor, *from,
                                          [&](std::size_t at, const std::uint8_t *element) {
                                              for (std::size_t k = 0; k < used; ++k)
                                                  values[at * components + k] =
                                                      read(element + k * size, from->is_normalised);
                                          });
        !changed)
        return changed.error();
    return values;
}

// Calls `change(number, bytes)` for the elements that the accessor states beside its buffer view.
template <class Change>
Status GltfDocument::for_sparse(std::size_t accessor, const Elements &from, const Change &change) {
    const Json *const sparse = member(item(root("accessors"), accessor), "sparse");
    if (sparse == nullptr)
        return {};
    const std::string name = name_of("accessors", accessor) + ".sparse";
    const Json *const places = member(sparse, "indices"), *const changes = member(sparse, "values");
    const std::size_t count = index_of(sparse, "count").value_or(0),
                      type = index_of(places, "componentType").value_or(0),
                      index_size = size_of_type(static_cast<int>(std::min<std::size_t>(type, 65535)));
    if (count > from.count || index_size == 0)
        return bad_input(name + " makes no sense");
    const Result<ByteView> indices = part(index_of(places, "bufferView").value_or(~std::size_t{0}),
                                          index_of(places, "byteOffset").value_or(0), count * index_size, name);
    if (!indices)
        return indices.error();
    const std::size_t element = from.components * size_of_type(from.type);
    const Result<ByteView> changed = part(index_of(changes, "bufferView").value_or(~std::size_t{0}),
                                          index_of(changes, "byteOffset").value_or(0), count * element, name);
    if (!changed)
        return changed.error();
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t at = whole(indices->data() + i * index_size, static_cast<int>(type));
        if (at >= from.count)
            return bad_input(name + " changes element " + std::to_string(at) + " of " + std::to_string(from.count));
        change(at, changed->data() + i * element);
    }
    return {};
}

Result<std::vector<std::uint32_t>> GltfDocument::indices(std::size_t accessor) {
    const Result<Elements> from = elements(accessor);
    if (!from)
        return from.error();
    if (from->components != 1 || from->type == 5126 || from->type == 5120 || from->type == 5122)
        return bad_input(name_of("accessors", accessor) + " has no type of indices");
    std::vector<std::uint32_t> values(from->count);
    for (std::size_t i = 0; i < from->count && !from->bytes.empty(); ++i)
        values[i] = whole(from->bytes.data() + i * from->stride, from->type);
    if (const Status changed =
            for_sparse(accessor, *from,
                       [&](std::size_t at, const std::uint8_t *element) { values[at] = whole(element, from->type); });
        !changed)
        return changed.error();
    return values;
}

} // namespace pbm::build
