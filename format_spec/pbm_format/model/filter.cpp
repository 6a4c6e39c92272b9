#include "pbm_format/model/filter.h"

namespace pbm {

Filter filter_of(const StreamInfo &stream, const AttributeSet &set) {
    switch (stream.kind) {
    case StreamKind::masks: return Filter::mask_rank;
    case StreamKind::normal: return Filter::normal;
    case StreamKind::radius: return Filter::radius;
    case StreamKind::colour: return set.colour == ColourFormat::rgb565 ? Filter::colour565 : Filter::colour888;
    case StreamKind::material: return Filter::material;
    case StreamKind::texture: return Filter::texture;
    case StreamKind::shadow: return Filter::shadow;
    }
    return Filter::none;
}

std::size_t plane_count(Filter filter) {
    switch (filter) {
    case Filter::none:
    case Filter::texels: return 0;
    case Filter::normal: return 2;
    case Filter::colour565:
    case Filter::colour888: return 3;
    case Filter::mask_rank:
    case Filter::radius:
    case Filter::material:
    case Filter::texture:
    case Filter::shadow: return 1;
    }
    return 0;
}

} // namespace pbm
