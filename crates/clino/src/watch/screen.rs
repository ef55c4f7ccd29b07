//! The screen: a table, the plot of the chosen sensor, a line for the keys and for what is wrong with the port.
//!
//! What it says, it says without colour, too: the chosen sensor has a mark, a bad status its word.

use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Cell, Chart, Dataset, GraphType, Paragraph, Row, Table};
use ratatui::{DefaultTerminal, Frame};

use super::state::{SHOWN, State, Watched};
use crate::bus::Stop;
use crate::feed::News;
use crate::say::thousandths;

/// From one picture to the next: a slow terminal gets no more than it needs.
const EVERY: Duration = Duration::from_millis(200);
/// The least height of a plot that says something.
const LEAST_PLOT: u16 = 7;
/// The least span of the angle axis, in degrees: less is the noise of a sensor.
const LEAST_SPAN: f64 = 0.02;
/// Part of the span that is left free above and below.
const MARGIN: f64 = 0.1;

/// How it looks.
struct Look {
    has_colour: bool,
    marker: Marker,
}

/// Draws until `q`, Ctrl-C, or `stop`. The terminal is as it was before.
///
/// # Errors
/// The terminal failed.
pub fn run(state: &mut State, feed: &Receiver<News>, stop: &Stop, has_colour: bool) -> io::Result<()> {
    let look = Look { has_colour, marker: if is_unicode() { Marker::Braille } else { Marker::Dot } };
    let mut terminal = ratatui::try_init()?;
    let ended = draw_until(&mut terminal, state, feed, stop, &look);
    // It is put back whatever happened.
    ratatui::try_restore()?;
    ended
}

fn draw_until(
    terminal: &mut DefaultTerminal,
    state: &mut State,
    feed: &Receiver<News>,
    stop: &Stop,
    look: &Look,
) -> io::Result<()> {
    let keys = keys();
    let mut chosen = 0;
    loop {
        let is_over = take_all(state, feed);
        if is_over || stop.is_asked() || state.never_opened().is_some() {
            return Ok(());
        }
        terminal.draw(|frame| draw(frame, state, chosen, look))?;
        let next = Instant::now() + EVERY;
        loop {
            let event = match keys.recv_timeout(next.saturating_duration_since(Instant::now())) {
                Ok(event) => event?,
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            };
            let Event::Key(key) = event else { break };
            if key.kind != KeyEventKind::Press {
                continue;
            }
            match key.code {
                KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
                // The terminal is raw: it makes no signal of it.
                KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => return Ok(()),
                KeyCode::Down | KeyCode::Char('j') => {
                    chosen = (chosen + 1).min(state.sensors.len().saturating_sub(1))
                }
                KeyCode::Up | KeyCode::Char('k') => chosen = chosen.saturating_sub(1),
                _ => continue,
            }
            break;
        }
    }
}

/// Keys and changes of the screen's size, read by a thread of their own: where the terminal has gone, crossterm reads its end
/// again and again, and comes back from neither `poll` nor `read`. The thread ends with the program.
fn keys() -> Receiver<io::Result<Event>> {
    let (to, from) = channel();
    thread::spawn(move || {
        loop {
            let event = event::read();
            let is_last = event.is_err();
            if to.send(event).is_err() || is_last {
                return;
            }
        }
    });
    from
}

/// Takes what has come; whether nothing more comes.
fn take_all(state: &mut State, feed: &Receiver<News>) -> bool {
    loop {
        match feed.try_recv() {
            Ok(news) => {
                state.take(news);
            }
            Err(TryRecvError::Empty) => return false,
            Err(TryRecvError::Disconnected) => return true,
        }
    }
}

fn draw(frame: &mut Frame<'_>, state: &State, chosen: usize, look: &Look) {
    let height = frame.area().height;
    let rows = u16::try_from(state.sensors.len()).unwrap_or(u16::MAX).saturating_add(1);
    // The plot has a half of the screen at least, unless that is too little for one.
    let plot = height.saturating_sub(rows).saturating_sub(1).max(height / 2);
    let plot = if plot < LEAST_PLOT { 0 } else { plot };
    let parts = [Constraint::Fill(1), Constraint::Length(plot), Constraint::Length(1)];
    let [table, chart, foot] = Layout::vertical(parts).areas(frame.area());
    draw_table(frame, table, state, chosen, look);
    if let Some(watched) = state.sensors.get(chosen).filter(|_| plot > 0) {
        draw_plot(frame, chart, watched, look);
    }
    let text = match &state.lost {
        Some(error) => format!("{}; it is opened again when it is back", error.message()),
        None => "q quits, arrows choose the sensor that is plotted".to_owned(),
    };
    frame.render_widget(Paragraph::new(Line::raw(text)), foot);
}

fn draw_table(frame: &mut Frame<'_>, area: Rect, state: &State, chosen: usize, look: &Look) {
    let now = Instant::now();
    let room = usize::from(area.height.saturating_sub(1)).max(1);
    // The chosen one is always among those that there is room for.
    let first = (chosen + 1).saturating_sub(room);
    let rows = state.sensors.iter().enumerate().skip(first).take(room).map(|(index, watched)| {
        let is_bad = watched.mdeg.is_none();
        let mark = if index == chosen { ">" } else { " " };
        let angle = watched.mdeg.map_or("-".to_owned(), |mdeg| thousandths(mdeg).to_string());
        let age = watched.at.map_or("never".to_owned(), |at| {
            format!("{:.1} s", now.saturating_duration_since(at).as_secs_f64())
        });
        let style = match (is_bad, look.has_colour) {
            (true, true) => Style::new().fg(Color::Red),
            (true, false) => Style::new().add_modifier(Modifier::BOLD),
            (false, _) => Style::new(),
        };
        let rate = format!("{:.1}", watched.rate(now, state.age()));
        let right = |text: String| Cell::from(Line::raw(text).right_aligned());
        Row::new([
            Cell::from(format!("{mark} {}", watched.sensor.name())),
            right(angle),
            Cell::from(watched.status).style(style),
            right(age),
            right(rate),
        ])
    });
    let widths = [
        Constraint::Length(15),
        Constraint::Length(10),
        Constraint::Length(18),
        Constraint::Length(10),
        Constraint::Length(8),
    ];
    let right = |text: &'static str| Cell::from(Line::raw(text).right_aligned());
    let header = Row::new([
        Cell::from("  sensor"),
        right("angle"),
        Cell::from("status"),
        right("age"),
        right("rate/s"),
    ]);
    frame.render_widget(Table::new(rows, widths).header(header.add_modifier_underlined()), area);
}

/// What sets the header off, with and without colour.
trait Underlined {
    fn add_modifier_underlined(self) -> Self;
}

impl Underlined for Row<'_> {
    fn add_modifier_underlined(self) -> Self {
        self.style(Style::new().add_modifier(Modifier::UNDERLINED))
    }
}

fn draw_plot(frame: &mut Frame<'_>, area: Rect, watched: &Watched, look: &Look) {
    let now = Instant::now();
    let ago = |at: Instant| -now.saturating_duration_since(at).as_secs_f64();
    let points: Vec<(f64, f64)> =
        watched.points.iter().map(|&(at, mdeg)| (ago(at), f64::from(mdeg) / 1_000.0)).collect();
    let bounds = bounds(points.iter().map(|&(_, degrees)| degrees));
    let shown = SHOWN.as_secs_f64();
    let style = if look.has_colour { Style::new().fg(Color::Cyan) } else { Style::new() };
    let dataset =
        Dataset::default().marker(look.marker).graph_type(GraphType::Scatter).style(style).data(&points);
    let label = |value: f64| format!("{value:9.3}");
    let minutes = SHOWN.as_secs() / 60;
    let chart = Chart::new(vec![dataset])
        .block(Block::bordered().title(format!(" {}, degrees ", watched.sensor.name())))
        .x_axis(Axis::default().bounds([-shown, 0.0]).labels([format!("-{minutes} min"), "now".to_owned()]))
        .y_axis(Axis::default().bounds(bounds).labels([label(bounds[0]), label(bounds[1])]));
    frame.render_widget(chart, area);
}

/// Lowest and highest of the plot.
fn bounds(degrees: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = degrees
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return [-1.0, 1.0];
    }
    let span = (high - low).max(LEAST_SPAN);
    let centre = (low + high) / 2.0;
    let half = span * (0.5 + MARGIN);
    [centre - half, centre + half]
}

/// Whether the terminal shows more than ASCII, as far as the environment says.
fn is_unicode() -> bool {
    let of = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
    let locale = of("LC_ALL").or_else(|| of("LC_CTYPE")).or_else(|| of("LANG")).unwrap_or_default();
    let locale = locale.to_ascii_lowercase();
    cfg!(windows) || locale.contains("utf-8") || locale.contains("utf8")
}
