// Listens to ghest-rt from C++: typed messages from the published JSON Schema, gaps filled, old angles never shown as new.
// README.md beside this file says how to build and run it.

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <iomanip>
#include <iostream>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <variant>

#include "gh_angles.hpp"  // made by quicktype from docs/schema/gh_angles.schema.json
#include "zenoh.hxx"

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto STALE_AFTER = 150ms;  // ten slots of the 66.6 Hz grid, by our own clock: no clocks need to agree
constexpr auto LOST_AFTER = 2s;       // then connect anew: zenoh-pico itself notices a broken connection after 10 s only
constexpr std::size_t BACKLOG = 2000;
constexpr long PAGE = 2;  // samples a question: unless built otherwise, zenoh-pico takes messages of 4 kB at most

// Zenoh calls back on its own threads; messages wait here for ours. Who is slow loses the oldest, not the station.
class Inbox {
   public:
    void put(std::string text) {
        std::lock_guard<std::mutex> lock(mutex_);
        if (waiting_.size() == BACKLOG) waiting_.pop_front();
        waiting_.push_back(std::move(text));
        arrived_.notify_one();
    }

    std::optional<std::string> take(Clock::duration patience) {
        std::unique_lock<std::mutex> lock(mutex_);
        if (!arrived_.wait_for(lock, patience, [this] { return !waiting_.empty(); })) return std::nullopt;
        std::string text = std::move(waiting_.front());
        waiting_.pop_front();
        return text;
    }

   private:
    std::mutex mutex_;
    std::condition_variable arrived_;
    std::deque<std::string> waiting_;
};

zenoh::Session connect(const std::string& endpoint) {
    while (true) {
        try {
            auto config = zenoh::Config::create_default();
            config.insert(Z_CONFIG_MODE_KEY, "client");
            config.insert(Z_CONFIG_CONNECT_KEY, endpoint.c_str());
            return zenoh::Session::open(std::move(config));
        } catch (const zenoh::ZException&) {
            std::cerr << "nobody listens at " << endpoint << " yet\n";
            std::this_thread::sleep_for(500ms);
        }
    }
}

// Asks one question and returns the answer, if one comes within a second.
std::optional<std::string> ask(zenoh::Session& session, const std::string& key, const std::string& parameters = "") {
    zenoh::Session::GetOptions options;
    options.timeout_ms = 1000;
    auto replies = session.get(zenoh::KeyExpr(key), parameters, zenoh::channels::FifoChannel(16), std::move(options));
    while (true) {
        auto received = replies.recv();
        if (!std::holds_alternative<zenoh::Reply>(received)) return std::nullopt;
        const auto& reply = std::get<zenoh::Reply>(received);
        if (reply.is_ok()) return reply.get_ok().get_payload().as_string();
    }
}

void show(const ghest::GhAngles& sample, const nlohmann::json& document, const char* note) {
    std::cout << std::setw(8) << sample.seq << "  " << document["status"].get<std::string>();
    if (sample.angles_deg) {
        std::cout << std::fixed << std::setprecision(2) << "  flexion " << sample.angles_deg->flexion << "  abduction "
                  << sample.angles_deg->abduction << "  rotation " << sample.angles_deg->rotation;
    } else {
        std::cout << "  no angles: " << document["reason"].get<std::string>();
    }
    std::cout << note << std::endl;
}

// Keeps count of one station's samples.
class Listener {
   public:
    Listener(std::string endpoint, const std::string& station, long wanted)
        : endpoint_(std::move(endpoint)), prefix_("ghest/" + station + "/"), wanted_(wanted) {}

    // Listens until the station has been silent for long, or enough was shown.
    void listen() {
        auto session = connect(endpoint_);
        Inbox inbox;
        auto subscriber = session.declare_subscriber(
            zenoh::KeyExpr(prefix_ + "gh/angles"),
            [&inbox](const zenoh::Sample& sample) { inbox.put(sample.get_payload().as_string()); }, zenoh::closures::none);
        if (auto last = ask(session, prefix_ + "last"); last && run_id_.empty()) {
            const auto document = nlohmann::json::parse(*last);
            show(document.get<ghest::GhAngles>(), document, "  (the last one; perhaps of long ago)");
        }
        auto heard = Clock::now();
        bool live = true;
        while (!done() && Clock::now() - heard < LOST_AFTER) {
            if (const auto text = inbox.take(STALE_AFTER)) {
                heard = Clock::now();
                live = true;
                take(session, nlohmann::json::parse(*text));
            } else if (live) {
                live = false;
                std::cout << "nothing new: show the patient no angles" << std::endl;
            }
        }
    }

    bool done() const { return wanted_ != 0 && shown_ >= wanted_; }

    void report() const { std::cout << shown_ << " samples, " << missing_ << " missing" << std::endl; }

   private:
    void take(zenoh::Session& session, const nlohmann::json& document) {
        if (document.value("schema_version", 1) != 1) {
            throw std::runtime_error("schema version " + document["schema_version"].dump() + ": this program knows 1");
        }
        const auto sample = document.get<ghest::GhAngles>();
        if (sample.run_id != run_id_) {  // the service was started anew: no gap
            run_id_ = sample.run_id;
            next_ = sample.seq;
        }
        while (next_ < sample.seq && fill(session, std::min<long>(next_ + PAGE, sample.seq) - 1)) {
        }
        missing_ += std::max<long>(0, sample.seq - next_);
        if (sample.seq >= next_) put(sample, document, "");
    }

    // Asks for the samples from next_ to last; false if the station does not have the first of them.
    bool fill(zenoh::Session& session, long last) {
        const auto range = "run_id=" + run_id_ + ";first=" + std::to_string(next_) + ";last=" + std::to_string(last);
        const auto answer = ask(session, prefix_ + "gh/recent", range);
        if (!answer) return false;
        const auto samples = nlohmann::json::parse(*answer)["samples"];
        if (samples.empty() || samples[0]["seq"] != next_) return false;
        for (const auto& missed : samples) put(missed.get<ghest::GhAngles>(), missed, "  (asked for again)");
        return true;
    }

    void put(const ghest::GhAngles& sample, const nlohmann::json& document, const char* note) {
        show(sample, document, note);
        next_ = sample.seq + 1;
        ++shown_;
    }

    std::string endpoint_, prefix_;
    std::string run_id_;
    long wanted_, next_ = 0, shown_ = 0, missing_ = 0;
};

int main(int count_arguments, char** arguments) {
    const std::string endpoint = count_arguments > 1 ? arguments[1] : "tcp/127.0.0.1:7447";
    const std::string station = count_arguments > 2 ? arguments[2] : "sim";
    Listener listener(endpoint, station, count_arguments > 3 ? std::atol(arguments[3]) : 0);  // 0: for ever
    try {
        while (!listener.done()) listener.listen();
    } catch (const std::exception& error) {
        std::cerr << error.what() << std::endl;
        return 1;
    }
    listener.report();
    return 0;
}
