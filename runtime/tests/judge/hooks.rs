//! Metrics of the user's own code: one that only rises, one that only falls, one that does neither.

use sesame_relay::metric::{Context, Hook, HookEntry};
use sesame_relay::value::Value;

use crate::robot::number_of;

/// What a hook makes of the numbers of its topic's messages. What is not finite it does not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HookKind {
    /// How many were above 1.
    Counting,
    /// The least.
    Least,
    /// The latest.
    Latest,
}

impl HookKind {
    pub(crate) const ALL: [HookKind; 3] = [HookKind::Counting, HookKind::Least, HookKind::Latest];

    /// The names of metrics of this kind; a case has no more than two of each.
    pub(crate) fn names(self) -> [&'static str; 2] {
        match self {
            HookKind::Counting => ["counting_hook", "counting_hook_too"],
            HookKind::Least => ["least_hook", "least_hook_too"],
            HookKind::Latest => ["latest_hook", "latest_hook_too"],
        }
    }

    /// The kind of the metric with this name.
    pub(crate) fn named(name: &str) -> HookKind {
        HookKind::ALL.into_iter().find(|kind| kind.names().contains(&name)).expect("a hook has one of these names")
    }
}

struct Counting;
struct Least;
struct Latest;

macro_rules! hook {
    ($name:ident, |$number:ident, $ctx:ident| $body:expr) => {
        impl Hook for $name {
            fn on_start(&mut self, _: &mut Context) {}
            fn on_message(&mut self, _: usize, value: &Value, $ctx: &mut Context) {
                let $number = number_of(value);
                if $number.is_finite() {
                    $body;
                }
            }
            fn on_end(&mut self, _: &mut Context) {}
        }
    };
}

hook!(Counting, |number, ctx| if number > 1.0 {
    ctx.add(1.0);
});
hook!(Least, |number, ctx| ctx.set(ctx.value().map_or(number, |least| least.min(number))));
hook!(Latest, |number, ctx| ctx.set(number));

/// All hooks a runner of any case has.
pub(crate) fn entries() -> Vec<HookEntry> {
    let mut entries = Vec::new();
    for kind in HookKind::ALL {
        for metric in kind.names() {
            let build: fn(&str) -> Box<dyn Hook> = match kind {
                HookKind::Counting => |_| Box::new(Counting),
                HookKind::Least => |_| Box::new(Least),
                HookKind::Latest => |_| Box::new(Latest),
            };
            entries.push(HookEntry { metric, build });
        }
    }
    entries
}
