//! Laws that were not told from the drifts of instruments that stand.

use cdpr::effect::EffectSpec;

use crate::hypothesis::extension::is_one_law;
use crate::report::phrase;
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::weigh::criterion::EVIDENCE;
use crate::write::{in_numbers, label, place};

/// What a reader should know of laws by which the data are as likely as with the drifts of instruments that stand.
pub(crate) fn not_told_from_drifts(context: &Context<'_>, fitted: &Fitted) -> Option<String> {
    let fit = &fitted.train;
    let (laws, change) = context.journal.last_as_likely()?;
    let there = |law: &EffectSpec| fit.model.effects.iter().any(|other| is_one_law(other, law));
    if !fit.randomness.drifts() || laws.iter().any(there) {
        return None;
    }
    let law = |law: &EffectSpec| {
        let what = phrase(&label(law), &place(law)).replace('\u{a0}', " ");
        format!("{what} ({})", in_numbers(law, &[]))
    };
    let laws = laws.iter().map(law).collect::<Vec<_>>().join(" and with ");
    let way = if change < 0.0 { "better" } else { "worse" };
    Some(format!(
        "Instruments that drift were not told from laws: with {laws} in the place of the drifts the data are as likely ({way} by {:.0} in the \
         criterion, where {EVIDENCE:.0} count). A law is there again in each recording, and a drift is another: record the same motion \
         again, with sensors that were referenced anew.",
        change.abs()
    ))
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::model::randomness::Memory;
    use crate::strategy::fixture::{begun, effect, evidence};

    /// A soft cable and a length that counted from another zero were drifts of two lengths, by 4 of the criterion less likely, and nothing was
    /// said to be missing.
    #[test]
    fn laws_that_were_not_told_from_drifts_are_said() {
        let evidence = evidence(&[], 98);
        let (context, standing) = begun(&evidence, &Model::default());
        let laws = [effect("cable_stiffness", Some(2), &[-0.05]), effect("length_sensor_bias", Some(4), &[0.03])];
        let mut drifting = standing.fit.clone();
        let drift = Memory { channel: 8, deviation: 0.02, time: 40.0, drift: true };
        drifting.train.randomness = drifting.train.randomness.with_memory(drift);
        assert_eq!(not_told_from_drifts(&context, &drifting), None);
        context.journal.as_likely_as_drifts(&laws, -3.9);
        let said = not_told_from_drifts(&context, &drifting).expect("a remark");
        assert!(said.contains("cable 2") && said.contains("better by 4 in the criterion"), "{said}");
        // Nothing drifts, or one of the laws stands.
        assert_eq!(not_told_from_drifts(&context, &standing.fit), None);
        drifting.train.model.effects.push(laws[1].clone());
        assert_eq!(not_told_from_drifts(&context, &drifting), None);
    }
}
