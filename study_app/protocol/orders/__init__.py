"""Orders of conditions and trials, and the schedule."""

from study_app.protocol.orders.balance import (
    Evenness,
    balances,
    block_balance,
    block_orders_by_group,
    describe_balance,
    evenness,
    numbered_participants,
)
from study_app.protocol.orders.block_orders import block_codes, order_of, orders_of
from study_app.protocol.orders.durations import duration_range_s, expected_duration_s, recordings_of, variants
from study_app.protocol.orders.schedule import (
    FormStep,
    PageStep,
    RecordedTrial,
    Schedule,
    Step,
    Trial,
    build_schedule,
    draw_key,
    reproduce,
)
from study_app.protocol.orders.tracks import tracks_of

__all__ = [
    "Evenness",
    "FormStep",
    "PageStep",
    "RecordedTrial",
    "Schedule",
    "Step",
    "Trial",
    "balances",
    "block_balance",
    "block_codes",
    "block_orders_by_group",
    "build_schedule",
    "describe_balance",
    "draw_key",
    "duration_range_s",
    "evenness",
    "expected_duration_s",
    "numbered_participants",
    "order_of",
    "orders_of",
    "recordings_of",
    "reproduce",
    "tracks_of",
    "variants",
]
