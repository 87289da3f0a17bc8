"""What is said of each code of a finding, and what is done about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class Words:
    """Of one code.

    Args:
        says: A sentence with the names of figures in braces; ``who`` is what it is about, ``unit`` the unit of the
            first of it, ``why`` why it cannot be said.
        do: What to do; empty where there is nothing to do.
    """

    says: str
    do: str = ""


SAID: Final[dict[str, Words]] = {
    "amount": Words("{usable:.0f} samples that count; experiments: {experiments:.0f}; {seconds:.4g} s in all."),
    "amount.few": Words(
        "Only {usable:.0f} samples count, the longest stretch has {longest:.0f}.",
        "Record more: several times the settling time, and ten samples for each parameter at least.",
    ),
    "amount.part": Words("Dynamics, noise and linearity are judged by the first {seen:.0f} of them."),
    "amount.masked": Words(
        "{share:.1%} of the samples do not count; what is left is {stretches:.0f} stretches of at most {longest:.0f}.",
        "Nothing, as long as the stretches are longer than the response. Each costs its first lags.",
    ),
    "amount.masked_output": Words(
        "{share:.1%} of the samples lack the output; what is left is {stretches:.0f} stretches of at most"
        " {longest:.0f}, and the inputs are known throughout.",
        "A transfer function, OE or a neural state space needs no measured past and loses these samples alone; ARX and"
        " what is fitted one step ahead lose all whose lags reach there.",
    ),
    "amount.no_input": Words(
        "There is no input: only the output's own past can be modelled.",
        "Fit an AR or NAR model, or name the inputs in the mapping.",
    ),
    "channels.sound": Words("No constants, spikes, limits or drifts were found."),
    "channel.constant_input": Words(
        "{who} never changes.", "Leave it out: what it does cannot be found from this record. Or record it moving."
    ),
    "channel.constant_output": Words(
        "{who} never changes.", "Check the sensor and the mapping: there is nothing to explain."
    ),
    "channel.few_levels": Words(
        "{who} takes {levels:.0f} values only: a switch, or a converter that is far too coarse.",
        "Model what drives it, or declare the switch; a smooth model can only round it off.",
    ),
    "channel.resolution": Words(
        "{who} moves in steps of {step:.3g} {unit}, {share:.2%} of its standard deviation.",
        "Where the steps are coarse: use a finer range of the converter, or sample more slowly; fit the free run (OE, a"
        " transfer function, loop: closed): one step ahead a model sees the steps.",
    ),
    "channel.clipped_above": Words(
        "{who} runs into {value:.4g} {unit} and stays there, for {share:.1%} of the samples: a limit above.",
        "Mask these samples (repairs: mask), declare the limit, or use a model that is not linear: a linear one is bent"
        " by them.",
    ),
    "channel.clipped_below": Words(
        "{who} runs into {value:.4g} {unit} and stays there, for {share:.1%} of the samples: a limit below.",
        "Mask these samples (repairs: mask), declare the limit, or use a model that is not linear: a linear one is bent"
        " by them.",
    ),
    "channel.spikes": Words(
        "Single samples of {who} jump away and back: {count:.0f}, by up to {largest:.3g} {unit}.",
        "Mask them (repairs: {{mask: [{{channel: {who}, start: ..., stop: ...}}]}}), or fit with a robust loss.",
    ),
    "channel.stuck": Words(
        "{who}: the output stands exactly still {stays:.0f} times while its inputs move on, longest at {value:.4g}"
        " {unit} from {seconds:.12g} s to {until:.12g} s ({samples:.0f} samples).",
        "Where the sensor is stuck, write under source: {why}. Where the plant is held (friction, a dead zone): leave"
        " it.",
    ),
    "channel.held": Words(
        "{who} changes only after {samples:.0f} samples ({seconds:.3g} s): it is measured more slowly than recorded.",
        "A model takes the hold for the plant's lag. Count new values alone: repairs: {{repeats: {{{who}: mask}}}}.",
    ),
    "channel.wraps": Words(
        "{who} jumps by {period:.6g} {jumps:.0f} times and goes on from there, as an angle or counter that wraps does.",
        "No model follows that: if it is one, put it together first, numpy.unwrap({who}, period={period:.6g}).",
    ),
    "channel.interpolated": Words(
        "{who} and the inputs go in straight lines of {samples:.0f} samples ({seconds:.3g} s): they were interpolated.",
        "The samples between were never measured, and intervals are too narrow: take every {samples:.0f}th sample.",
    ),
    "output.jump": Words(
        "{who}: at {seconds:.10g} s the level shifts by {size:.3g} {unit}, and no input did it.",
        "Cut the record there into two experiments, or add what changed as an input.",
    ),
    "output.drift": Words(
        "{who}: the output drifts by {size:.3g} {unit} over the stretch, and no input does it.",
        "Take it off (repairs: {{drift: {{{channel}: line}}}}), or add its cause as an input; or the plant integrates.",
    ),
    "output.sums": Words(
        "{who}: the output drifts by {size:.3g} over the stretch with the sum of that input: beside its quick answer"
        " the plant adds up what comes in, as the charge of a battery or the level of a tank.",
        "Do not take it off: fit what adds up exactly (NSS with integrators: 1), or equations.",
    ),
    "excitation.low": Words(
        "{who} is exciting of order {order:.0f} only: too few frequencies, or too slow.",
        "Move it more and faster: sysid excite prbs or multisine. With this record only a gain, or one time constant.",
    ),
    "excitation.few_moves": Words(
        "{who} moves only {moves:.0f} times.",
        "A few steps show gains and dead times; for a model move it some twenty times: sysid excite prbs.",
    ),
    "excitation.some": Words(
        "{who} is exciting of order {order:.0f} (of {looked_for:.0f} looked for); 99 % of its power is below"
        " {band:.3g} Hz.",
        "Low orders can be fitted, with fewer parameters than that; what is faster than its band is not in the record.",
    ),
    "excitation.rich": Words(
        "{who} is exciting of order {order:.0f} or more; 99 % of its power is below {band:.3g} Hz."
    ),
    "excitation.two_levels": Words(
        "{who} has two levels in each experiment.",
        "A curved gain cannot be seen with two levels: for a model that is not linear use sysid excite aprbs.",
    ),
    "collinearity.same": Words(
        "{who} are one and the same for {share:.2%} of what moves the worst of them.",
        "Leave one out: what each does cannot be told apart. Or move them independently.",
    ),
    "collinearity.alike": Words(
        "{who} move together: the others hold {share:.0%} of the worst of them.",
        "Expect wide bands for each by itself; prefer few parameters, or move them independently.",
    ),
    "collinearity.none": Words("{who} can be told apart: the others hold {share:.0%} of the worst of them."),
    "collinearity.unknown": Words("Whether {who} can be told apart: the record is too short to say."),
    "feedback.found": Words(
        "The output acts on {who}: inputs to come hold {share:.0%} of what the past leaves open of the output"
        " (at once: {share_at_once:.0%}).",
        "Closed loop: use ARX or a network one step ahead, with enough noise model; instrumental variables and"
        " correlations from these inputs are biased. Record with an external set point. An input that is not set but"
        " measured, and moves between samples, looks the same: then fit with intersample: foh, or nk: 0.",
    ),
    "feedback.exchanged": Words(
        "{who} answers the output, and not the output {who}: a linear response explains {backward:.0%} of {who}, and"
        " {forward:.0%} the other way round.",
        "Are input and output exchanged? Then write the mapping the other way round. If not, the clocks of two loggers"
        " are apart, or a controller sets {who} from the output.",
    ),
    "feedback.slight": Words(
        "Inputs to come hold {share:.1%} of what the past leaves open: slight feedback, or inputs that are not held"
        " between samples.",
        "Nothing for a first model. Are the inputs held constant between samples?",
    ),
    "feedback.holds": Words(
        "No noise goes round that would show it, but the plant by itself runs away, and its output does not: something"
        " holds it, as a controller that sets {who}.",
        "Record the set point as well, and model the loop from there; or predict some steps ahead (ARX, loop: open).",
    ),
    "feedback.none": Words("No sign that the output acts on the inputs (p = {p:.2g})."),
    "feedback.unknown": Words("Whether the output acts on the inputs: {why}."),
    "dynamics.unknown": Words("How the output answers: {why}."),
    "effect.none": Words(
        "{who} has no effect of its own that can be measured.",
        "Leave it out, unless it changes what other inputs do; or move it more than the noise hides.",
    ),
    "effect.unseen": Words(
        "No single lag of {who} shows what it does: noise hides it, or it moves too little, as in a single step, where"
        " the response and a drift look alike.",
        "Keep it, as it is the only input that moves. Of one step fit a transfer function of one or two poles; for more"
        ", move it some twenty times (sysid excite prbs), and by more than the noise.",
    ),
    "effect.shared": Words(
        "What {who} does: it moves as other inputs do, and nobody can tell what each of them brings.",
        "Leave out what is made of others, or move it independently.",
    ),
    "effect.by_product": Words(
        "{who} changes what other inputs do: its products with their response explain {share:.0%} of what a linear"
        " response leaves.",
        "Keep it: a network, or equations, can use it (a flow that sets a dead time, a speed, a mode).",
    ),
    "response.varies": Words(
        "The response changes over the record, from {low:.2g} to {high:.2g} times its mean: that explains {share:.0%}"
        " of what a linear response leaves.",
        "Wear, temperature, an operating point? Give what changed as an input, or cut the record: one model is a mean.",
    ),
    "dynamics.runs_away": Words(
        "By itself {who} runs away: the ARX model of least BIC has a pole of magnitude {pole:.4g}, which grows e-fold"
        " in {seconds:.3g} s.",
        "A free run from these inputs is lost by then, whatever the model, and gains and settling would be those of the"
        " loop. Model the loop from its set point, or judge some steps ahead.",
    ),
    "dynamics.rings": Words(
        "{who} rings for longer than the {lags_seconds:.3g} s of the response: at {hertz:.4g} Hz, damping"
        " {damping:.2g}. An equation with past outputs explains {explained:.1%} in free run, the response"
        " {response:.1%}.",
        "Fit what has poles (a transfer function, a linear state space, ARX), and judge it in free run.",
    ),
    "dynamics.lasts": Words(
        "{who} answers for longer than the {lags_seconds:.3g} s of the response: its slowest pole has {seconds:.3g} s."
        " An equation with past outputs explains {explained:.1%} in free run, the response {response:.1%}.",
        "Fit what has poles (a transfer function, a linear state space, ARX), and judge it in free run.",
    ),
    "dead_time": Words(
        "{who} acts after {best:.0f} samples ({seconds:.3g} s); from sample {visible:.0f} on it is plain to see."
    ),
    "dead_time.vague": Words(
        "{who} acts after {low:.0f} to {high:.0f} samples, most likely {best:.0f} ({seconds:.3g} s).",
        "Search the dead time together with the orders: sysid orders.",
    ),
    "dead_time.unknown": Words("When {who} begins to act cannot be told from the noise."),
    "settling": Words(
        "A step of {who} settles within {seconds:.3g} s ({samples:.0f} samples); its gain is {gain:.4g} ±"
        " {gain_deviation:.2g}."
    ),
    "settling.little": Words(
        "A step of {who} settles within {seconds:.3g} s ({samples:.0f} samples) at a gain of {gain:.4g} ±"
        " {gain_deviation:.2g}, by a response that explains only {explained:.0%} of the output.",
        "Beside noise alone the gain is as sure as it says. Beside inputs that are missing, or a plant that integrates"
        " or is not linear, it is none: see below.",
    ),
    "settling.short_record": Words(
        "A step of {who} takes {seconds:.3g} s to settle; the record is only {length:.1f} times that.",
        "Record ten times the settling time at least.",
    ),
    "settling.integrates": Words(
        "A step of {who} does not settle: as far as this record shows the plant integrates, its output stays wherever"
        " it is left.",
        "Fit what adds up exactly: NSS with integrators: 1, whose free run does not drift as a pole near one makes it."
        " A mode much slower than the record is long looks the same: a longer one tells them apart.",
    ),
    "settling.never": Words(
        "A step of {who} does not settle within {lags_seconds:.3g} s.",
        "An integrator, a very slow mode or a drift: fit with a pole near one, or record longer.",
    ),
    "settling.unknown": Words(
        "How long a step of {who} takes: linear models explain {explained:.0%} of the output, too little to say."
    ),
    "sampling.good": Words("A step response of {who} rises over {rise:.1f} samples."),
    "sampling.little": Words(
        "A step response of {who} rises over {rise:.1f} samples; it explains only {explained:.0%} of the output."
    ),
    "sampling.fast": Words(
        "A step response of {who} rises over {rise:.0f} samples: sampled faster than a model wants.",
        "Resample to some {proposed:.3g} s, filtered before: poles near one are hard to fit, and lags reach too short.",
    ),
    "sampling.slow": Words(
        "The output has answered {who} within a sample or two: sampled too slowly to see how.",
        "Sample at {proposed:.3g} s or faster.",
    ),
    "sampling.at_once": Words(
        "The output answers {who} within the sample: a fixed ratio, and no dynamics to model.",
        "Is one made from the other? Otherwise sample at {proposed:.3g} s or faster.",
    ),
    "sampling.unknown": Words("Whether the sample time is good: {why}."),
    "noise.quiet": Words(
        "A linear response explains {explained:.2%} of the output: {decibel:.0f} dB above what is left."
    ),
    "noise.some": Words(
        "A linear response explains {explained:.1%} of the output; what is left is {deviation:.3g} {unit} in root mean"
        " square, noise or what is not linear.",
        "Validate by free run; fit more samples than parameters by far.",
    ),
    "noise.loud": Words(
        "A linear response explains only {explained:.1%} of the output.",
        "Noise, inputs that are missing, or a system that integrates or is not linear: see below. More samples help"
        " against noise alone.",
    ),
    "noise.coloured": Words(
        "What is left is coloured: an autoregression of order {order:.0f}.",
        "Use a structure with a noise model of its own, or judge ARX by its free run, not one step ahead.",
    ),
    "noise.unknown": Words("How much is noise: {why}."),
    "linearity.exact": Words("A linear response leaves nothing to explain ({left:.1e} of the output)."),
    "linearity.none_seen": Words(
        "Curvature explains {share:.0%} of the {left:.2%} that a linear response leaves: none that is sure. It would"
        " not show friction, play, or what two levels hide."
    ),
    "linearity.perhaps_curved": Words(
        "Curvature may explain {share:.0%} of the {left:.2%} that a linear response leaves; the record is too short to"
        " be sure (p = {p:.1g}).",
        "Try a network beside the linear model, and compare them in free run.",
    ),
    "linearity.slightly_curved": Words(
        "Curvature explains {share:.0%} of the {left:.2g} of the output's variance that a linear response leaves.",
        "A linear model may do; compare it with a network in free run.",
    ),
    "linearity.curved": Words(
        "Not linear: curvature explains {share:.0%} of the {left:.2%} that a linear response leaves.",
        "Fit a network; the linear model is its start and its yardstick.",
    ),
    "linearity.curved_state": Words(
        "Not linear: curves of past outputs explain {share:.0%} of what a linear equation leaves {seconds:.3g} s"
        " ahead.",
        "Fit a network with past outputs or states; the linear model is its start and its yardstick.",
    ),
    "linearity.nothing_explained": Words(
        "A linear response explains {explained:.1%}: nothing can be said of curvature.",
        "Inputs that are missing, or a system that answers to no sign of its input (a square, an absolute value): try"
        " a network with few neurons.",
    ),
    "linearity.best_linear_is_enough": Words(
        "Over {periods:.0f} periods of {period:.0f} samples distortion is at {distortion_db:.0f} dB, noise at"
        " {noise_db:.0f} dB of the output: linear."
    ),
    "linearity.slightly_distorted": Words(
        "Over {periods:.0f} periods of {period:.0f} samples distortion is at {distortion_db:.0f} dB of the output,"
        " noise at {noise_db:.0f} dB.",
        "A linear model is as good as that distortion at this amplitude.",
    ),
    "linearity.distorted": Words(
        "Not linear: over {periods:.0f} periods of {period:.0f} samples distortion is at {distortion_db:.0f} dB of the"
        " output, noise at {noise_db:.0f} dB.",
        "Fit a network. A linear model is the best linear approximation at this amplitude, and no more.",
    ),
    "linearity.unknown": Words("Whether it is linear: {why}."),
    "coherence": Words(
        "The inputs account for {mean:.0%} of the output by frequency, up to {band:.3g} Hz for at least half of it."
    ),
    "coherence.low": Words(
        "By frequency the inputs account for {mean:.0%} of the output; for at least half of it up to {band:.3g} Hz.",
        "Above that a model has nothing to go by.",
    ),
    "coherence.unknown": Words("Coherence: {why}."),
    "structure.arx": Words("{label}: the ARX model of least BIC.", "sysid orders shows the others."),
    "structure.transfer_function": Words("{label}: a transfer function, whose noise is on the output."),
    "structure.transfer_function_noise": Words(
        "{label}: a transfer function; what is left is noise on the output, which ARX takes for dynamics."
    ),
    "structure.integrates": Words("{label}: its output adds up exactly, as the plant's does."),
    "structure.curve": Words(
        "{label}: a network without memory, since a line is not enough and the output answers at once."
    ),
    "structure.network": Words("{label}: a network, since a line is not enough."),
}
