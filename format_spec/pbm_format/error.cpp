#include "pbm_format/error.h"

namespace pbm {

std::string_view to_string(ErrorCode code) {
    switch (code) {
    case ErrorCode::usage: return "usage";
    case ErrorCode::io: return "io";
    case ErrorCode::not_bvg: return "not_bvg";
    case ErrorCode::truncated: return "truncated";
    case ErrorCode::bad_hash: return "bad_hash";
    case ErrorCode::bad_header: return "bad_header";
    case ErrorCode::bad_table: return "bad_table";
    case ErrorCode::bad_section: return "bad_section";
    case ErrorCode::bad_directory: return "bad_directory";
    case ErrorCode::bad_octree: return "bad_octree";
    case ErrorCode::bad_attribute: return "bad_attribute";
    case ErrorCode::bad_image: return "bad_image";
    case ErrorCode::bad_content: return "bad_content";
    case ErrorCode::bad_input: return "bad_input";
    case ErrorCode::too_large: return "too_large";
    case ErrorCode::memory: return "memory";
    case ErrorCode::unsupported_version: return "unsupported_version";
    case ErrorCode::unsupported_feature: return "unsupported_feature";
    }
    return "unknown";
}

bool has_offset(const Error &error) {
    switch (error.code) {
    case ErrorCode::truncated:
    case ErrorCode::bad_hash:
    case ErrorCode::bad_header:
    case ErrorCode::bad_table:
    case ErrorCode::bad_section:
    case ErrorCode::bad_directory:
    case ErrorCode::bad_octree:
    case ErrorCode::bad_attribute:
    case ErrorCode::bad_image:
    case ErrorCode::bad_content: return true;
    default: return error.offset != 0;
    }
}

int exit_code(ErrorCode code) {
    switch (code) {
    case ErrorCode::usage: return 1;
    case ErrorCode::io: return 2;
    case ErrorCode::memory: return 4;
    case ErrorCode::unsupported_version:
    case ErrorCode::unsupported_feature: return 5;
    default: return 3;
    }
}

} // namespace pbm
