#include "launcher/notify_socket.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <cstddef>
#include <cstring>
#include <random>

namespace breakshot::launcher {
namespace {

void send_to(const NotifySocket& socket, const std::string& text) {
  const UniqueFd fd{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& name = socket.address();
  std::memcpy(address.sun_path + 1, name.data() + 1, name.size() - 1);
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  ASSERT_EQ(::sendto(fd.get(), text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&address), length),
            static_cast<ssize_t>(text.size()));
}

TEST(ParseNotification, ReadsTheWordsOfSdNotify) {
  const Notification all = parse_notification("READY=1\nSTATUS=table in sight\nMAINPID=12\nWATCHDOG=1\nSTOPPING=1\n");
  EXPECT_TRUE(all.ready);
  EXPECT_TRUE(all.watchdog);
  EXPECT_TRUE(all.stopping);
  EXPECT_EQ(all.status, "table in sight");
}

TEST(ParseNotification, TakesNothingFromWhatItDoesNotKnow) {
  for (const char* text : {"", "\n\n", "READY", "READY=0", "READY=11", "ready=1", " READY=1", "WATCHDOG=trigger", "X=READY=1"}) {
    const Notification result = parse_notification(text);
    EXPECT_FALSE(result.ready || result.watchdog || result.stopping || result.status) << text;
  }
}

TEST(ParseNotification, SurvivesRandomBytes) {
  std::mt19937 random{1};
  for (int i = 0; i < 10'000; ++i) {
    std::string text(random() % 64, '\0');
    for (char& character : text) character = "READYSTUWCHOG=1\n\0\xff"[random() % 18];
    parse_notification(text);
  }
}

TEST(NotifySocket, HearsTheExpectedSenderOnly) {
  NotifySocket socket;
  EXPECT_TRUE(socket.address().starts_with('@'));
  send_to(socket, "READY=1");
  EXPECT_FALSE(socket.receive(::getpid() + 1)) << "somebody else's word";
  EXPECT_FALSE(socket.receive(::getpid())) << "and it is gone then";
  send_to(socket, "STATUS=one");
  send_to(socket, "STATUS=two");
  EXPECT_EQ(socket.receive(::getpid())->status, "one");
  EXPECT_EQ(socket.receive(::getpid())->status, "two");
  EXPECT_FALSE(socket.receive(::getpid()));
}

TEST(NotifySocket, DoesNotTakeTheWordOfAnotherProcess) {
  NotifySocket socket;
  const pid_t child = ::fork();
  if (child == 0) {
    send_to(socket, "READY=1");
    ::_exit(0);
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  EXPECT_FALSE(socket.receive(::getpid()));
}

TEST(NotifySocket, EachHasItsOwnAddress) {
  const NotifySocket one;
  const NotifySocket two;
  EXPECT_NE(one.address(), two.address());
}

}  // namespace
}  // namespace breakshot::launcher
