#pragma once

#include "client/order_client.hpp"
#include "common/time.hpp"

#include <string>

namespace breakshot::client {

/// Listens for a moment and prints what each process of the cell says of itself, and what the gateway tells the factory.
/// @param json  one JSON object instead of a table
/// @return 0 when every process heard is ready, 1 otherwise, 3 when nothing was heard
int run_status(int cell_domain, OrderClient& client, Duration listen, bool json);

}  // namespace breakshot::client
