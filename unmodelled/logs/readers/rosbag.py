"""Read bags of ROS 1 and ROS 2 with rosbags, without ROS."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import Records, is_wanted, message_fields


class RosBag(Reader):
    """Reader of bags: every topic is a table with the time at which its messages were recorded."""

    name = "ROS bag"
    install = "rosbags"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        if path.is_dir():
            return (path / "metadata.yaml").is_file()
        return start.startswith(b"#ROSBAG V2.0") or (
            path.suffix == ".db3" and start.startswith(b"SQLite format 3\x00")
        )

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        topics: dict[str, Records] = {}
        # bags of ROS 2 before Iron hold no definitions of their messages
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
            used = [
                c for c in bag.connections if is_wanted(c.topic, wanted) and c.msgtype in bag.typestore.types
            ]
            for connection, stamp, data in bag.messages(used) if used else ():
                records = topics.setdefault(connection.topic, Records(connection.topic, message_fields))
                message = bag.deserialize(data, connection.msgtype)
                publisher = getattr(connection.ext, "callerid", None) or str(connection.id)
                records.add(message, 1e-9 * (stamp - bag.start_time), publisher)
        return [table for records in topics.values() for table in records.tables()]
