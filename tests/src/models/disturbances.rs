//! Operations of the many kinds that disturb values and messages.

use super::items::{Field, Kind, Space, written};
use super::words::{quoted, text};

impl Space {
    /// What one disturbs, how, and what a test chooses for it.
    pub(super) fn disturbance(&mut self) -> (String, String, Kind) {
        let field = self.field();
        let of_message = self.topic();
        let range = self.range_of(&field);
        let one = |word, range, unit: &str| Kind::Values(vec![(word, range, unit.to_owned())]);
        let milliseconds = *self.draw.one(&[(0.0, 100.0), (0.0, 0.0), (20.0, 500.0)]);
        let drain = *self.draw.one(&["", " drain flush", " drain drop", " drain finish"]);
        let Field { written: target, unit, whole } = field;
        match self.draw.below(18) {
            0 => (target, format!("stuck at {}", written(range, unit)), one("value", range, unit)),
            1 => (target, format!("bias {}", written(range, unit)), one("bias", range, unit)),
            2 => {
                let range = (range.0.abs().min(range.1.abs()), range.0.abs().max(range.1.abs()));
                (target, format!("noise {}", written(range, unit)), one("sigma", range, unit))
            }
            3 => {
                let range = self.draw.range();
                (target, format!("scale {}", written(range, "")), one("factor", range, ""))
            }
            4 if matches!(unit, "mm" | "m" | "rad" | "deg") => {
                let (range, unit) = (self.draw.range(), format!("{unit}/s"));
                (target, format!("drift {}", written(range, &unit)), one("rate", range, &unit))
            }
            5 if !whole => {
                let what = *self.draw.one(&["nan", "infinity", "-infinity"]);
                (target, what.to_owned(), Kind::Nothing)
            }
            6 => (target, "freeze".to_owned(), Kind::Nothing),
            7 => (of_message, "freeze".to_owned(), Kind::Nothing),
            8 => (target, format!("stale {}", written(milliseconds, "ms")), one("age", milliseconds, "ms")),
            9 => (of_message, format!("stale {}", written(milliseconds, "ms")), one("age", milliseconds, "ms")),
            10 => {
                let loss = self.draw.chance(0.5);
                let clause = if loss { "  loss [12.5%, 100%]" } else { "" };
                let mut values = vec![("enter", (0.0, 50.0), "%".to_owned()), ("leave", (25.0, 75.0), "%".to_owned())];
                values.extend(loss.then(|| ("loss", (12.5, 100.0), "%".to_owned())));
                let source = format!("burst loss {{ enter [0%, 50%]  leave [25%, 75%]{clause} }}");
                (of_message, source, Kind::Values(values))
            }
            11 => (of_message, "rate limit [0.5Hz, 20Hz]".to_owned(), one("rate", (0.5, 20.0), "Hz")),
            12 => {
                let source = format!("reorder {}{drain}", written(milliseconds, "ms"));
                (of_message, source, one("window", milliseconds, "ms"))
            }
            13 => (of_message, "duplicate [1, 3]".to_owned(), one("copies", (1.0, 3.0), "")),
            14 => {
                let source = format!("latency {} normal{drain}", written(milliseconds, "ms"));
                (of_message, source, Kind::Range { word: "delay", range: milliseconds, unit: "ms" })
            }
            15 => match self.text_place() {
                Some(place) => {
                    let texts: Vec<String> = (0..self.draw.between(1, 3))
                        .map(|at| quoted(&format!("{}{at}", text(&mut self.draw))))
                        .collect();
                    (place, format!("random one of {}", texts.join(", ")), Kind::Nothing)
                }
                None => (of_message, "blackhole".to_owned(), Kind::Nothing),
            },
            16 => {
                let range = (range.0.abs().min(range.1.abs()), range.0.abs().max(range.1.abs()));
                (target, format!("random walk {}", written(range, unit)), one("sigma", range, unit))
            }
            _ => (of_message, "packet loss [0%, 100%]".to_owned(), one("loss", (0.0, 100.0), "%")),
        }
    }
}
