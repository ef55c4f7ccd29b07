//! What the page may do: set the soft zero of a slot, scan a bus, acknowledge an alarm. Through the gateway's console, as a
//! person would.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::json;

use super::Shared;
use crate::source::Command;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    gateway: String,
    command: Word,
    slot: Option<u16>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Word {
    /// The soft zero of a slot.
    Zero,
    /// The T7s of the bus.
    Scan,
    /// Alarms of a slot, or of all.
    Acknowledge,
}

pub async fn command(State(shared): State<Arc<Shared>>, Json(asked): Json<Asked>) -> Response {
    let line = match (asked.command, asked.slot) {
        (Word::Zero, Some(slot)) => format!("zero {slot}"),
        (Word::Zero, None) => return (StatusCode::BAD_REQUEST, "zero needs a slot").into_response(),
        (Word::Scan, _) => "t7 scan".to_owned(),
        (Word::Acknowledge, Some(slot)) => format!("acknowledge {slot}"),
        (Word::Acknowledge, None) => "acknowledge".to_owned(),
    };
    let Some(gateway) = shared.hub.find(&asked.gateway) else {
        return (StatusCode::NOT_FOUND, "no such gateway").into_response();
    };
    let Some(commands) = shared.sources.commands(gateway) else {
        return (StatusCode::CONFLICT, "this gateway is not read at its console").into_response();
    };
    let (answer, answered) = tokio::sync::oneshot::channel();
    if commands.try_send(Command { line, answer }).is_err() {
        return (StatusCode::TOO_MANY_REQUESTS, "other commands wait").into_response();
    }
    match answered.await {
        Ok(Ok(objects)) => {
            let failed = objects.iter().any(|object| object.get("error").is_some());
            let status = if failed { StatusCode::UNPROCESSABLE_ENTITY } else { StatusCode::OK };
            (status, Json(json!({ "answer": objects }))).into_response()
        }
        Ok(Err(why)) => (StatusCode::BAD_GATEWAY, why).into_response(),
        Err(_) => (StatusCode::BAD_GATEWAY, "the gateway was lost").into_response(),
    }
}
