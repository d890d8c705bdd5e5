"""A health message as families of metrics, with the units and names that Prometheus recommends. Needs the extra `metrics`."""

from collections.abc import Iterator, Mapping

from prometheus_client.metrics_core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
    Metric,
)

from ghest_rt.messages.published import Health, InputHealth, InputState, LatenessHistogram
from ghest_rt.messages.results import Status

Events = Mapping[tuple[str, str, str], int]


def families(station: str, version: str, health: Health | None, age_s: float | None, events: Events) -> Iterator[Metric]:
    """Yield every metric.

    Args:
        station: The station's id.
        version: Of the program.
        health: The newest message; None before the first.
        age_s: How old it is: it grows when the loop hangs.
        events: How many events there were, by source, kind and severity.
    """
    yield InfoMetricFamily("ghest", "The station and its program", {"station": station, "version": version})
    counted = CounterMetricFamily("ghest_events", "Events by source, kind and severity", labels=["source", "kind", "severity"])
    for labels, count in events.items():
        counted.add_metric(list(labels), count)
    yield counted
    if health is None or age_s is None:
        return
    yield GaugeMetricFamily("ghest_health_age_seconds", "Since the loop last told its state; grows if it hangs", value=age_s)
    yield from _samples(health)
    yield from _process(health)
    yield from _inputs(health.inputs)


def _samples(health: Health) -> Iterator[Metric]:
    yield _one_of("ghest_status", "Status of the newest sample", "status", health.status, list(Status))
    published = CounterMetricFamily("ghest_samples", "Samples published, by status", labels=["status"])
    lost = health.published - health.valid - health.degraded
    for status, count in ((Status.VALID, health.valid), (Status.DEGRADED, health.degraded), (Status.LOST, lost)):
        published.add_metric([str(status)], count)
    yield published
    yield GaugeMetricFamily("ghest_rate_hertz", "Samples published a second, over the last second", value=health.rate_hz)
    yield CounterMetricFamily("ghest_missed_ticks", "Grid slots skipped: the machine was too busy", value=health.missed_ticks)
    unused = CounterMetricFamily("ghest_unused_samples", "Samples that the estimator did not use", labels=["reason"])
    for reason, count in health.unused.items():
        unused.add_metric([reason], count)
    yield unused
    if health.lateness_histogram is not None:
        yield _lateness(health.lateness_histogram)


def _lateness(histogram: LatenessHistogram) -> Metric:
    buckets = [(f"{edge_us * 1e-6:.9g}", float(ticks)) for edge_us, ticks in zip(histogram.le_us, histogram.ticks, strict=True)]
    return HistogramMetricFamily(
        "ghest_tick_lateness_seconds",
        "How late the ticks came",
        buckets=[*buckets, ("+Inf", float(histogram.count))],
        sum_value=histogram.sum_us * 1e-6,
    )


def _process(health: Health) -> Iterator[Metric]:
    yield GaugeMetricFamily("ghest_uptime_seconds", "Since the start of the run", value=health.uptime_s)
    yield GaugeMetricFamily("ghest_cpu_ratio", "Of one core, over the last second", value=health.cpu_percent / 100)
    yield GaugeMetricFamily("ghest_resident_memory_bytes", "Resident memory", value=health.memory_mb * 1e6)
    yield GaugeMetricFamily("ghest_threads", "Threads", value=health.threads)
    yield GaugeMetricFamily("ghest_open_files", "File descriptors", value=health.open_files)
    yield CounterMetricFamily("ghest_major_page_faults", "Page faults that waited for the disk", value=health.major_faults)
    longest_s = health.collection_ms * 1e-3
    yield GaugeMetricFamily("ghest_garbage_collection_longest_seconds", "Longest round between two ticks", value=longest_s)


def _inputs(inputs: Mapping[str, InputHealth]) -> Iterator[Metric]:
    state = GaugeMetricFamily("ghest_input_state", "1 for the state that the input is in", labels=["input", "state"])
    rate = GaugeMetricFamily("ghest_input_rate_hertz", "Samples a second, over the last second", labels=["input"])
    age = GaugeMetricFamily("ghest_input_age_seconds", "Age of its newest sample", labels=["input"])
    warmth = GaugeMetricFamily("ghest_input_temperature_celsius", "Of the device, where it tells", labels=["input"])
    refused = CounterMetricFamily(
        "ghest_input_refused", "What the device or its driver did not pass on", labels=["input", "reason"]
    )
    counters = {
        "received": CounterMetricFamily("ghest_input_received", "Samples taken from the device", labels=["input"]),
        "missing": CounterMetricFamily("ghest_input_missing", "Gaps in the device's own count", labels=["input"]),
        "skipped": CounterMetricFamily("ghest_input_skipped", "Frames that vision was too slow for", labels=["input"]),
        "bad": CounterMetricFamily("ghest_input_bad", "Samples that could not be used", labels=["input"]),
        "reopened": CounterMetricFamily("ghest_input_reopened", "Times the device was opened again", labels=["input"]),
    }
    for name, item in inputs.items():
        for one in InputState:
            state.add_metric([name, str(one)], float(item.state is one))
        rate.add_metric([name], item.rate_hz)
        if item.age_ms is not None:
            age.add_metric([name], item.age_ms * 1e-3)
        if item.temperature_c is not None:
            warmth.add_metric([name], item.temperature_c)
        for reason, count in item.refused.items():
            refused.add_metric([name, reason], count)
        for field, family in counters.items():
            family.add_metric([name], getattr(item, field))
    yield from (state, rate, age, warmth, refused, *counters.values())


def _one_of(name: str, text: str, label: str, value: str, values: list[Status]) -> Metric:
    family = GaugeMetricFamily(name, text, labels=[label])
    for one in values:
        family.add_metric([str(one)], float(one == value))
    return family
