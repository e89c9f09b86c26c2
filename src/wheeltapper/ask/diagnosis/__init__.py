"""What a wheelset's bouncing over a site says of it; `public` is the room that `wheeltapper.diagnosis` opens."""
