// What ranks send each other: JSON in few bytes (MessagePack), in which numbers and texts stay what they are to the
// bit.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/scan/ranks.hpp"

namespace tubule {

inline Packet packed(const nlohmann::json& json) {
    Packet out;
    nlohmann::json::to_msgpack(json, out);
    return out;
}

inline nlohmann::json unpacked(const Packet& packet) {
    return nlohmann::json::from_msgpack(packet);
}

}  // namespace tubule
