#pragma once

#include "client/order_client.hpp"
#include "common/config/cell_config.hpp"
#include "mes_gateway/mes_gateway_config.hpp"

#include <atomic>
#include <cstdint>
#include <string>

namespace breakshot::client {

/// Exit statuses of `breakshot order`, `breakshot stop` and `breakshot recover`.
inline constexpr int kExitEnded = 0;
inline constexpr int kExitAborted = 1;
inline constexpr int kExitRejected = 2;
inline constexpr int kExitNoAnswer = 3;

/// What `breakshot order` was asked to send.
struct OrderOptions {
  mes::JobSpec spec;
  Duration wait_ready = std::chrono::seconds{10};  ///< how long to wait for a cell that is not ready yet
  bool detach = false;                             ///< return once the order is accepted
};

/// Sends an order and follows it with a live line per change on standard output.
///
/// When `interrupted` becomes true the order is cancelled and followed to its end: an operator who presses Ctrl-C wants the arm to stop.
/// @return one of the exit statuses above
int run_order(OrderClient& client, const OrderOptions& options, const std::atomic<bool>& interrupted);

/// Asks a stopped cell to recover, and says what that ended or what still stands in the way. @return kExitEnded when nothing is stopped any more
int run_recover(OrderClient& client);

/// Stops whatever runs. @return kExitEnded when the cell acknowledged
int run_cancel(OrderClient& client);

}  // namespace breakshot::client
