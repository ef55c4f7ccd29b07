//! The endpoint that Prometheus scrapes: `GET /metrics`.
//!
//! There is a sample of an angle only while it is right and fresh: one that is not there is *absent*, for an alert to find. A
//! scrape reads the state of the hub; nothing is kept for it.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use axum::Router;
use axum::http::header::CONTENT_TYPE;
use axum::routing::get;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::text::encode;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric as _};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::Registry;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::config::{Config, Prometheus};
use crate::health::BridgeHealth;
use crate::hub::{GatewayState, Hub};
use crate::sensor::{OK, Outcome, degrees};

/// As the OpenMetrics specification has it.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Listens.
pub async fn start(
    config: &Prometheus,
    hub: &Arc<Hub>,
    (health, whole): (Arc<BridgeHealth>, &Config),
    mut over: watch::Receiver<bool>,
) -> Result<JoinHandle<()>, String> {
    let listener =
        TcpListener::bind(config.listen).await.map_err(|why| format!("{}: {why}", config.listen))?;
    let mut registry = Registry::default();
    registry.register_collector(Box::new(State {
        hub: hub.clone(),
        health,
        has_broker: whole.mqtt.is_some(),
        has_influx: whole.influx.is_some(),
    }));
    let registry = Arc::new(registry);
    let metrics = move || {
        let registry = registry.clone();
        async move {
            let mut text = String::new();
            // Writing into a text does not fail.
            let _ = encode(&mut text, &registry);
            ([(CONTENT_TYPE, OPEN_METRICS)], text)
        }
    };
    let router = Router::new().route("/metrics", get(metrics));
    Ok(tokio::spawn(async move {
        let ended = async move { _ = over.wait_for(|over| *over).await };
        let _ = axum::serve(listener, router).with_graceful_shutdown(ended).await;
    }))
}

struct State {
    hub: Arc<Hub>,
    health: Arc<BridgeHealth>,
    has_broker: bool,
    has_influx: bool,
}

impl fmt::Debug for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("State")
    }
}

type Labels = Vec<(&'static str, String)>;

fn of_sensor(gateway: &GatewayState, slot: u16, outcome: &Outcome) -> Labels {
    vec![
        ("gateway", gateway.config.name.to_string()),
        ("slot", slot.to_string()),
        ("bus", outcome.bus.to_string()),
        ("address", outcome.address.to_string()),
        ("name", gateway.config.sensor(slot).unwrap_or_default().to_owned()),
    ]
}

impl State {
    /// A gauge with a sample for each sensor of which `value` has one.
    fn sensors(
        &self,
        encoder: &mut DescriptorEncoder<'_>,
        (name, help): (&str, &str),
        value: impl Fn(&GatewayState, u16, &Outcome) -> Option<(Labels, f64)>,
    ) -> fmt::Result {
        let mut family = encoder.encode_descriptor(name, help, None, MetricType::Gauge)?;
        for gateway in (0..self.hub.len()).filter_map(|number| self.hub.gateway(number)) {
            for (slot, outcome) in &gateway.sensors {
                if let Some((labels, value)) = value(&gateway, *slot, outcome) {
                    ConstGauge::new(value).encode(family.encode_family(&labels)?)?;
                }
            }
        }
        Ok(())
    }

    fn gateways(
        &self,
        encoder: &mut DescriptorEncoder<'_>,
        (name, help): (&str, &str),
        value: impl Fn(&GatewayState) -> Option<f64>,
    ) -> fmt::Result {
        let mut family = encoder.encode_descriptor(name, help, None, MetricType::Gauge)?;
        for gateway in (0..self.hub.len()).filter_map(|number| self.hub.gateway(number)) {
            if let Some(value) = value(&gateway) {
                let labels: Labels = vec![("gateway", gateway.config.name.to_string())];
                ConstGauge::new(value).encode(family.encode_family(&labels)?)?;
            }
        }
        Ok(())
    }

    /// Counters of the buses, as the console's lines have them.
    fn buses(&self, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
        let help = "What happened on a bus since the gateway's reset";
        let mut family = encoder.encode_descriptor("clino_bus_events", help, None, MetricType::Counter)?;
        for gateway in (0..self.hub.len()).filter_map(|number| self.hub.gateway(number)) {
            for ((bus, kind), values) in
                gateway.buses.iter().filter(|((_, kind), _)| matches!(&**kind, "stats" | "line"))
            {
                for (event, count) in values.iter().filter_map(|(name, value)| Some((name, value.as_u64()?)))
                {
                    let labels: Labels = vec![
                        ("gateway", gateway.config.name.to_string()),
                        ("bus", bus.to_string()),
                        ("kind", kind.to_string()),
                        ("event", event.clone()),
                    ];
                    ConstCounter::new(count).encode(family.encode_family(&labels)?)?;
                }
            }
        }
        Ok(())
    }

    fn bridge(&self, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
        let health = &self.health;
        let flag = |flag: &AtomicBool| u64::from(flag.load(Ordering::Relaxed));
        let count = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let broker_gauges = [
            ("clino_broker_connected", "1 while the broker is connected", flag(&health.is_connected)),
            ("clino_broker_waiting", "Messages that wait for the broker", count(&health.waiting)),
            (
                "clino_store_trouble",
                "1 while the disk does not take messages",
                flag(&health.has_disk_trouble),
            ),
        ];
        let broker_counters = [
            ("clino_broker_confirmed", "Messages that the broker has confirmed", count(&health.confirmed)),
            ("clino_broker_dropped", "Messages that were dropped beyond the bound", count(&health.dropped)),
            ("clino_broker_lost", "Connections that were lost", count(&health.lost)),
        ];
        let influx_gauges = [
            ("clino_influx_waiting", "Lines that wait for InfluxDB", count(&health.lines_waiting)),
            ("clino_influx_trouble", "1 while InfluxDB does not take lines", flag(&health.has_line_trouble)),
        ];
        let influx_counters = [(
            "clino_influx_dropped",
            "Lines that were dropped beyond the bound",
            count(&health.lines_dropped),
        )];
        let bridge_counters = [(
            "clino_clock_jumps",
            "Jumps of this computer's clock by more than a second",
            count(&health.clock_jumps),
        )];
        let no = (&[][..], &[][..]);
        let broker = if self.has_broker { (&broker_gauges[..], &broker_counters[..]) } else { no };
        let influx = if self.has_influx { (&influx_gauges[..], &influx_counters[..]) } else { no };
        for (gauges, counters) in [broker, influx, (&[], &bridge_counters)] {
            for (name, help, value) in gauges {
                let gauge = encoder.encode_descriptor(name, help, None, MetricType::Gauge)?;
                ConstGauge::new(*value).encode(gauge)?;
            }
            for (name, help, value) in counters {
                let counter = encoder.encode_descriptor(name, help, None, MetricType::Counter)?;
                ConstCounter::new(*value).encode(counter)?;
            }
        }
        Ok(())
    }
}

impl Collector for State {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let now = Instant::now();
        let angle = ("clino_angle_degrees", "Angle, only while it is right and fresh");
        self.sensors(&mut encoder, angle, |gateway, slot, outcome| {
            Some((of_sensor(gateway, slot, outcome), degrees(outcome.value()?)))
        })?;
        let age = ("clino_age_seconds", "Time since the last good value was measured");
        self.sensors(&mut encoder, age, |gateway, slot, outcome| {
            Some((of_sensor(gateway, slot, outcome), outcome.age_ms(now)? as f64 / 1_000.0))
        })?;
        let status = ("clino_sensor_status", "1 for the status that a sensor has");
        self.sensors(&mut encoder, status, |gateway, slot, outcome| {
            let mut labels = of_sensor(gateway, slot, outcome);
            labels.push(("status", outcome.status.to_string()));
            Some((labels, 1.0))
        })?;
        let ok = ("clino_sensor_ok", "1 if the angle is right and fresh, 0 if it is not");
        self.sensors(&mut encoder, ok, |gateway, slot, outcome| {
            Some((of_sensor(gateway, slot, outcome), f64::from(u8::from(&*outcome.status == OK))))
        })?;
        let up = ("clino_gateway_up", "1 while the gateway speaks");
        self.gateways(&mut encoder, up, |gateway| Some(f64::from(u8::from(gateway.gone.is_none()))))?;
        let boots = ("clino_gateway_boots", "Starts since power-up");
        self.gateways(&mut encoder, boots, |gateway| Some(gateway.start.as_ref()?.boots.into()))?;
        let crashes = ("clino_gateway_crashes", "Starts since power-up that ended in a crash");
        self.gateways(&mut encoder, crashes, |gateway| Some(gateway.start.as_ref()?.crashes.into()))?;
        let alarms = ("clino_gateway_alarms", "Alarms that are active or not acknowledged");
        self.gateways(&mut encoder, alarms, |gateway| Some(gateway.alarms.len() as f64))?;
        self.buses(&mut encoder)?;
        self.bridge(&mut encoder)
    }
}
