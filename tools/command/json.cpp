#include "tools/command/json.hpp"

namespace tubule {

namespace {

void drop_signs_of_zero(Json& json) {
    if (json.is_structured())
        for (Json& part : json) drop_signs_of_zero(part);
    else if (json.is_number_float() && json.get<double>() == 0)
        json = 0.0;
}

}  // namespace

std::string line_of(Json json) {
    drop_signs_of_zero(json);
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace tubule
