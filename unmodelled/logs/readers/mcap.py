"""Read MCAP files with messages of ROS 2 (CDR) or in JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import Records, is_wanted, message_fields


class Mcap(Reader):
    """Reader of MCAP files: every topic is a table with the time at which its messages were logged."""

    name = "MCAP"
    install = "mcap mcap-ros2-support"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"\x89MCAP0\r\n")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        topics: dict[str, Records] = {}
        unknown: dict[str, str] = {}
        ros, decoders = DecoderFactory(), dict[int, Callable[[bytes], Any] | None]()
        first: int | None = None
        with path.open("rb") as file:
            for schema, channel, message in make_reader(file).iter_messages():
                first = message.log_time if first is None else first
                if not is_wanted(channel.topic, wanted) or channel.topic in unknown:
                    continue
                if channel.id not in decoders:
                    encoding = channel.message_encoding
                    decoders[channel.id] = (
                        json.loads if encoding == "json" else ros.decoder_for(encoding, schema)
                    )
                decode = decoders[channel.id]
                if decode is None:
                    unknown[channel.topic] = channel.message_encoding or "no encoding"
                    continue
                records = topics.setdefault(channel.topic, Records(channel.topic, message_fields))
                publisher = channel.metadata.get("callerid", str(channel.id))
                records.add(decode(message.data), 1e-9 * (message.log_time - first), publisher)
        found = [table for records in topics.values() for table in records.tables()]
        if not found and unknown:
            topic, encoding = next(iter(unknown.items()))
            raise BadInput(f"{path}: messages of {topic} are in {encoding}: convert them to ROS 2 or JSON")
        return found
