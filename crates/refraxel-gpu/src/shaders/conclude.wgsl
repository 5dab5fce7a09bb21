// The outcome of a step: some words in a ring that the host reads now and then. A failure stays until the next load.

@compute @workgroup_size(1)
fn conclude() {
    let failed = min(status[STATUS_FAILED] | status[STATUS_LOSS] | status[STATUS_PARAMETER], 1u);
    let at = OUTCOME_WORDS * task.outcome;
    outcomes[at] = status[STATUS_ERROR];
    outcomes[at + 1u] = status[STATUS_ERROR + 1u];
    outcomes[at + 2u] = status[STATUS_SAMPLES];
    outcomes[at + 3u] = failed;
    outcomes[at + 4u] = status[STATUS_OVERFLOWS];
    outcomes[at + 5u] = status[STATUS_CUT];
    outcomes[at + 6u] = task.rays - status[STATUS_ABSENT];
    status[STATUS_FAILED] = failed;
    status[STATUS_LOSS] = 0u;
    status[STATUS_PARAMETER] = 0u;
    status[STATUS_SAMPLES] = 0u;
    status[STATUS_OVERFLOWS] = 0u;
    status[STATUS_CUT] = 0u;
    status[STATUS_ABSENT] = 0u;
    status[STATUS_ERROR] = 0u;
    status[STATUS_ERROR + 1u] = 0u;
}
