//! The live page: what a browser gets.
//!
//! | path | what |
//! |---|---|
//! | `/` `/page.css` `/page.js` `/plotly.js` | the page; everything is in this program |
//! | `/login?token=…` | a cookie for the token, then the page |
//! | `/api/state` | all gateways and sensors, once |
//! | `/api/events` | what changes, as server-sent events, ten times a second |
//! | `/api/history` `/api/csv` | what a plot shows |
//! | `POST /api/command` | zero, scan, acknowledge; only with `--allow-writes` |
//!
//! Who may read and write is in `page/access.rs`.

mod access;
mod assets;
mod commands;
mod events;
mod state;

pub use access::Access;
pub use state::Memory;

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router, middleware};
use clino_codec::angle::Angle;
use serde::Deserialize;
use serde_json::json;

use crate::clock::Wall;
use crate::csv;
use crate::hub::Hub;
use crate::sensor::degrees;
use crate::source::Sources;

/// What the handlers share.
pub struct Shared {
    pub hub: Arc<Hub>,
    pub memory: Arc<Memory>,
    pub access: Access,
    pub sources: Sources,
    pub events: events::Events,
}

/// All of it.
pub fn router(shared: Arc<Shared>) -> Router {
    let guard = middleware::from_fn_with_state(shared.clone(), access::guard);
    Router::new()
        .route("/", get(assets::page))
        .route("/page.css", get(assets::style))
        .route("/page.js", get(assets::script))
        .route("/plotly.js", get(assets::plotly))
        .route("/api/state", get(whole_state))
        .route("/api/events", get(events::stream))
        .route("/api/history", get(history))
        .route("/api/csv", get(as_csv))
        .route("/api/command", post(commands::command))
        .layer(guard)
        .route("/login", get(access::login))
        .layer(middleware::map_response(access::harden))
        .with_state(shared)
}

/// Begins to hand out events.
pub fn events(hub: &Arc<Hub>, memory: &Arc<Memory>) -> events::Events {
    events::start(hub, memory)
}

async fn whole_state(State(shared): State<Arc<Shared>>) -> Json<serde_json::Value> {
    Json(state::whole(&shared.hub, &shared.memory, shared.access.allows_writes()))
}

/// Which plot.
#[derive(Deserialize)]
struct Plot {
    gateway: String,
    slot: u16,
    span_s: u32,
}

/// Shortest and longest plot.
const SPAN_S: std::ops::RangeInclusive<u32> = 60..=86_400;

impl Plot {
    fn span(&self, shared: &Shared) -> Result<crate::history::Span, (StatusCode, &'static str)> {
        if !SPAN_S.contains(&self.span_s) {
            return Err((StatusCode::BAD_REQUEST, "span_s: 60 to 86400"));
        }
        let gateway = shared.hub.find(&self.gateway);
        let span = Duration::from_secs(self.span_s.into());
        gateway
            .and_then(|gateway| shared.memory.last(gateway, self.slot, span, Instant::now()))
            .ok_or((StatusCode::NOT_FOUND, "no such sensor"))
    }
}

async fn history(State(shared): State<Arc<Shared>>, Query(plot): Query<Plot>) -> Response {
    let span = match plot.span(&shared) {
        Ok(span) => span,
        Err(refusal) => return refusal.into_response(),
    };
    let ms = |time: Duration| i64::try_from(time.as_millis()).unwrap_or(i64::MAX);
    let of = |pick: fn((Angle, Angle)) -> Angle| -> Vec<Option<f64>> {
        span.extents.iter().map(|extent| extent.map(|extent| degrees(pick(extent)))).collect()
    };
    Json(json!({
        "from": Wall::now().0.saturating_sub(ms(span.back)),
        "interval_ms": ms(span.interval),
        "lowest": of(|(low, _)| low),
        "highest": of(|(_, high)| high),
    }))
    .into_response()
}

async fn as_csv(State(shared): State<Arc<Shared>>, Query(plot): Query<Plot>) -> Response {
    match plot.span(&shared) {
        Ok(span) => {
            let name = format!("attachment; filename=\"{}-slot{}.csv\"", plot.gateway, plot.slot);
            let head = [(CONTENT_TYPE, "text/csv; charset=utf-8".to_owned()), (CONTENT_DISPOSITION, name)];
            (head, csv::write(&span, Wall::now())).into_response()
        }
        Err(refusal) => refusal.into_response(),
    }
}
