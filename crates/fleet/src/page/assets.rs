//! The files of the page.

use axum::http::header::{CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE};
use axum::response::{Html, IntoResponse};

const SCRIPT: &str = "text/javascript; charset=utf-8";

pub async fn page() -> Html<&'static str> {
    Html(include_str!("../../page/index.html"))
}

pub async fn style() -> impl IntoResponse {
    ([(CONTENT_TYPE, "text/css; charset=utf-8")], include_str!("../../page/page.css"))
}

pub async fn script() -> impl IntoResponse {
    ([(CONTENT_TYPE, SCRIPT)], include_str!("../../page/page.js"))
}

/// Every browser unpacks it by itself.
pub async fn plotly() -> impl IntoResponse {
    let head =
        [(CONTENT_TYPE, SCRIPT), (CONTENT_ENCODING, "gzip"), (CACHE_CONTROL, "private, max-age=86400")];
    (head, &include_bytes!(concat!(env!("OUT_DIR"), "/plotly.js.gz"))[..])
}
