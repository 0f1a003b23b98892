//! Runtime monitors.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child};
use crate::syntax::ast::eddi::{Demand, Eddi, Evidence, Guarantee, Mitigation, Otherwise, Stale, State};

impl Reader<'_> {
    pub(super) fn eddi(&mut self, pair: &Pair<'_>) -> Eddi {
        let state = if let Some(published) = child(pair, Rule::state_topic) {
            State::Published(self.name(&expect_child(&published, Rule::name)))
        } else {
            let external = expect_child(pair, Rule::external);
            let on = child(&external, Rule::path).map(|path| self.path(&path));
            State::External(self.keyword_span(&external), on)
        };
        let mut eddi = Eddi {
            head: self.head(pair),
            state,
            demands: vec![],
            evidence: vec![],
            guarantees: vec![],
            otherwise: vec![],
            has_errors: false,
        };
        eddi.has_errors = self.members(pair, |reader, member| match member.as_rule() {
            Rule::demand => {
                let from = children(&member, Rule::name).nth(1).expect("a demand names whom it is made of");
                eddi.demands.push(Demand { head: reader.head(&member), eddi: reader.name(&from) });
            }
            Rule::evidence => {
                let evidence = reader.evidence(&member);
                eddi.evidence.push(evidence);
            }
            Rule::guarantee => eddi.guarantees.push(Guarantee {
                head: reader.head(&member),
                integrity: reader.count(&expect_child(&member, Rule::number)),
                gate: child(&member, Rule::expression).map(|gate| reader.expression(&gate)),
            }),
            _ => {
                let otherwise = reader.otherwise(&member);
                eddi.otherwise.push((reader.keyword_span(&member), otherwise));
            }
        });
        eddi
    }

    fn evidence(&mut self, pair: &Pair<'_>) -> Evidence {
        let held = children(pair, Rule::held)
            .map(|held| (self.keyword_span(&held), self.signed(&expect_child(&held, Rule::signed))))
            .collect();
        let stale = children(pair, Rule::stale).map(|stale| {
            let after = self.signed(&expect_child(&stale, Rule::signed));
            let (unknown, all) = (child(&stale, Rule::k_unknown).is_some(), child(&stale, Rule::k_all).is_some());
            (self.keyword_span(&stale), Stale { after, unknown, all })
        });
        let stale = stale.collect();
        let condition = self.expression(&expect_child(pair, Rule::expression));
        let inbound = children(pair, Rule::inbound).map(|inbound| self.span(&inbound)).collect();
        Evidence { head: self.head(pair), condition, held, stale, inbound }
    }

    fn otherwise(&mut self, pair: &Pair<'_>) -> Otherwise {
        let mitigation = child(pair, Rule::mitigation).map(|mitigation| {
            let path = self.path(&expect_child(&mitigation, Rule::path));
            let value = if let Some(truth) = child(&mitigation, Rule::truth) {
                Mitigation::Truth(child(&truth, Rule::k_true).is_some(), self.span(&truth))
            } else if let Some(number) = child(&mitigation, Rule::signed) {
                Mitigation::Number(self.signed(&number))
            } else {
                Mitigation::Text(self.text_of(&expect_child(&mitigation, Rule::text)))
            };
            (path, value)
        });
        Otherwise { head: self.head(pair), mitigation }
    }
}
