//! What was said, as a line for people and as an object for programs.

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::Value;

use super::frames::{Item, What};
use crate::hex;

const US_PER_S: u64 = 1_000_000;
/// Room for the bytes of most frames.
const BYTES_WIDTH: usize = 26;

/// For people.
pub fn line(item: &Item) -> String {
    let (mark, text) = match &item.what {
        What::Command { json } => ("->", words(json)),
        What::Answer { json, after_us: Some(after_us) } => {
            ("<-", format!("{}, after_us {after_us}", words(json)))
        }
        What::Answer { json, after_us: None } => ("<-", words(json)),
        What::Bad { bad } => ("!!", bad.message().to_owned()),
        What::Unanswered => ("!!", "no answer to this command".to_owned()),
    };
    format!("{} {mark} {:<BYTES_WIDTH$} {text}\n", seconds(item.at_us), hex::show(&item.bytes))
}

/// For programs: the members of `decode`, behind time, direction and bytes.
pub fn object(item: &Item) -> String {
    let (direction, rest) = match &item.what {
        What::Command { json } => ("\"command\"", inner(json).to_owned()),
        What::Answer { json, after_us: Some(after_us) } => {
            ("\"answer\"", format!("{},\"after_us\":{after_us}", inner(json)))
        }
        What::Answer { json, after_us: None } => ("\"answer\"", inner(json).to_owned()),
        What::Bad { bad } => ("null", inner(&serde_json::to_string(bad).unwrap_or_default()).to_owned()),
        What::Unanswered => (
            "\"command\"",
            r#""error":{"kind":"no_answer","message":"no answer to this command"}"#.to_owned(),
        ),
    };
    let bytes = hex::show(&item.bytes);
    format!("{{\"at_us\":{},\"direction\":{direction},\"bytes\":\"{bytes}\",{rest}}}\n", item.at_us)
}

fn seconds(us: u64) -> String {
    format!("{:5}.{:06}", us / US_PER_S, us % US_PER_S)
}

/// The members of an object.
fn inner(json: &str) -> &str {
    json.strip_prefix('{').and_then(|json| json.strip_suffix('}')).unwrap_or(json)
}

/// `name value, name value`
fn words(json: &str) -> String {
    let members = serde_json::from_str::<Members>(json).map(|members| members.0).unwrap_or_default();
    let word = |value: &Value| match value {
        Value::String(text) => text.clone(),
        value => value.to_string(),
    };
    members.iter().map(|(name, value)| format!("{name} {}", word(value))).collect::<Vec<_>>().join(", ")
}

/// The members of an object, in their order.
struct Members(Vec<(String, Value)>);

impl<'de> Deserialize<'de> for Members {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Members;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Members, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}
