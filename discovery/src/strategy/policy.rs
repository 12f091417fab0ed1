//! Every threshold of the search, each with its unit and the reason for its size.
//!
//! What the information criterion itself asks is in [`criterion`](crate::weigh::criterion), what a verdict asks in
//! [`verdict`](crate::verdict).

use crate::verdict::POLICY as VERDICT;

/// Thresholds of the search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Policy {
    /// Share of the evidence by which the `-2 log L` of held-out data must fall for an effect to help there: half, for they
    /// are other motions, and nothing was fitted to them.
    pub(crate) helps: f64,
    /// Gap over the main horizon on held-out data up to which nothing is left to explain.
    pub(crate) nothing_left: f64,
    /// Gap from which a missing law may be so strong that it hides itself: the trajectory without it is then so wrong that
    /// its signature misleads.
    pub(crate) strong: f64,
    /// Share of the evidence that an effect must explain; below it a law that hides itself is looked for before the search
    /// goes on.
    pub(crate) hidden: f64,
    /// Share of the evidence from which an effect found first is most of what is missing, so that its form shows; and of what
    /// is left then, that the form, the times between which it acts, or forces that were recorded late must explain, and of the gap that a slow clock must: half.
    pub(crate) most: f64,
    /// Most times that a search begins again with something undone that recording did: once beside what is still missing, once beside what
    /// was found, and once more.
    pub(crate) most_undone: usize,
    /// Most effects added: a simulation that lacks more is another machine's.
    pub(crate) most_effects: usize,
    /// Most rounds in which effects or instruments come in one after the other: four for each effect that may stand, for some are made one with
    /// others again.
    pub(crate) most_rounds: usize,
    /// Most candidates of one round that are fitted in full before the round is given up: those after it explain less.
    pub(crate) most_refusals: usize,
    /// Most terms outside the catalogue that are added one after the other.
    pub(crate) most_terms: usize,
    /// Gap at which terms need not be added any more: the noise is hardly known better.
    pub(crate) terms_explain_all: f64,
    /// Share of what is left of the gap that terms outside the catalogue may leave at most to be worth reading: half.
    pub(crate) terms_leave: f64,
    /// Share of the gap of what was named that terms in its place may leave: clearly less, for a name says more than a term.
    pub(crate) terms_instead: f64,
    /// Gauss-Newton rounds of a refinement: it ends by itself after some five.
    pub(crate) rounds: usize,
    /// Gauss-Newton rounds by which a start is judged, one of a refinement that starts near its end, those of laws on the
    /// beginnings from a typical size, and on the whole from there.
    pub(crate) rounds_of_a_start: usize,
    pub(crate) rounds_near_the_end: usize,
    pub(crate) rounds_from_typical: usize,
    pub(crate) rounds_of_finalists: usize,
    /// Moves of a trajectory: of the model as given, which starts from the data alone; of one on held-out data; and where
    /// friction has become a state.
    pub(crate) first_moves: usize,
    pub(crate) held_out_moves: usize,
    pub(crate) settling_moves: usize,
    /// Length of the beginnings of trials, by which laws are chosen for the whole, in turns of the position that turns least often: some
    /// motion in every direction.
    pub(crate) turns: f64,
    /// The most that it may be (s): where a machine turns seldom, the work counts.
    pub(crate) longest_beginning: f64,
    /// How long before the last effect begins they start, as a share of that length: the filter must have settled.
    pub(crate) lead: f64,
    /// What the criterion must rise on the beginnings for an explanation to be far off: ten times the evidence.
    pub(crate) far_off: f64,
    /// The same for no shape of a law to make up for it: ten times as much again.
    pub(crate) hopeless: f64,
    /// Share of the best candidate's gain at which a simpler one is preferred: signatures are exact to some per cent.
    pub(crate) simpler: f64,
    /// Share of the gain of a candidate from which another one is worth a full comparison: of those that the catalogue says
    /// are alike, and of all others.
    pub(crate) rival_alike: f64,
    pub(crate) rival: f64,
    /// Share of what instruments explain that a law must promise to be fitted in their place, with what is asked for beside it: less is
    /// not worth the time.
    pub(crate) promising: f64,
    /// Most rivals of one effect that are fitted in full.
    pub(crate) most_rivals: usize,
    /// Most replacements of one effect by another, so that two do not take turns.
    pub(crate) most_replacements: usize,
    /// Candidates of which pairs are formed: all that do best alone, for some 400 pairs.
    pub(crate) paired: usize,
    /// Most refinements of a form one after the other.
    pub(crate) most_refinements: usize,
    /// Laws looked at from a typical size that go on to the whole.
    pub(crate) finalists: usize,
    /// Share of the gap that a law looked at from a typical size may leave: half.
    pub(crate) look_leaves: f64,
    /// Standard errors squared, of an effect's size from zero, below which nearly nothing is left out with it, or it is too little beside
    /// recorded forces with an error, and from which it leaves a gap whatever the others do and is no work of noise: ten and twenty
    /// standard errors.
    pub(crate) uncertain: f64,
    pub(crate) certain: f64,
    /// Factor within which it is known how far the lost forces move a size: how a controller answers its own errors is not. Damping that
    /// was not there came out eleven standard errors from zero where they were said to move it by two.
    pub(crate) lost_within: f64,
    /// Share of what an effect explains that its size, in standard errors, squared, must come to: it is at least as much where
    /// the law is linear; a half allows for those that are not.
    pub(crate) seen: f64,
    /// Segments into which the recordings are cut where an effect may begin or end: some seconds each.
    pub(crate) segments: usize,
    /// The same where many candidates are weighed first, how many of these there are, and how many go on.
    pub(crate) few_segments: usize,
    pub(crate) weighed_in_time: usize,
    pub(crate) finalists_in_time: usize,
    /// Chance, over a whole recording, below which a sample of innovations is sudden, how many such times are looked at, and
    /// how many samples they are apart: the plant is shaken for about as long.
    pub(crate) sudden: f64,
    pub(crate) most_sudden: usize,
    pub(crate) sudden_apart: usize,
    /// Segments on either side of a time that is located among them: enough for the profile's minimum to lie inside.
    pub(crate) around: usize,
    /// Most times that an estimate of a time is located anew.
    pub(crate) most_locations: usize,
    /// Moves of a time, in its standard errors, below which it has been located.
    pub(crate) located: f64,
    /// So many laws at once are as much to ask as that the geometry is not quite as given.
    pub(crate) several_laws: usize,
    /// Share of the forces at random that errors of the survey may leave to be looked for.
    pub(crate) survey_leaves: f64,
}

/// The thresholds in use.
pub(crate) const POLICY: Policy = Policy {
    helps: 0.5,
    nothing_left: VERDICT.nothing_left,
    strong: 5.0,
    hidden: 0.05,
    most: 0.5,
    most_undone: 3,
    most_effects: 5,
    most_rounds: 20,
    most_refusals: 4,
    most_terms: 3,
    terms_explain_all: 1.05,
    terms_leave: 0.5,
    terms_instead: 0.8,
    rounds: 10,
    rounds_of_a_start: 3,
    rounds_near_the_end: 4,
    rounds_from_typical: 6,
    rounds_of_finalists: 5,
    first_moves: 10,
    held_out_moves: 30,
    settling_moves: 3,
    turns: 4.0,
    longest_beginning: 30.0,
    lead: 1.0 / 6.0,
    far_off: 100.0,
    hopeless: 1000.0,
    simpler: 0.93,
    rival_alike: 0.5,
    rival: 0.8,
    promising: 0.1,
    most_rivals: 3,
    most_replacements: 4,
    paired: 30,
    most_refinements: 3,
    finalists: 3,
    look_leaves: 0.5,
    uncertain: 100.0,
    certain: 400.0,
    lost_within: 6.0,
    seen: 0.5,
    segments: 40,
    few_segments: 10,
    weighed_in_time: 30,
    finalists_in_time: 3,
    sudden: 1e-3,
    most_sudden: 3,
    sudden_apart: 20,
    around: 12,
    most_locations: 6,
    located: 0.5,
    several_laws: 3,
    survey_leaves: 0.2,
};
