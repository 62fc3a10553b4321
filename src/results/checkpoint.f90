!> Checkpoints: all that a run needs to continue, and its result so far, in one file.
!!
!! The file is HDF5 with the named numbers under /state. It is followed by the bytes of the result
!! file as they are, and a last line with both lengths and a checksum of everything before it. So
!! a damaged file is recognized before any library reads it, and whatever has become of the
!! result file meanwhile, the run continues with a whole one. The file is written under another
!! name, brought to the disk, and replaces the previous one.
module checkpoint
  use, intrinsic :: iso_fortran_env, only: int8, int64
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t, to_text, append_text
  use checksum, only: file_checksum
  use ranks, only: ranks_t, is_first, share_error
  use store_gather, only: gather_entry
  use state_store, only: state_store_t, add_entry
  use system_files, only: remove_file, is_no_file, kind_of_file, true_path, draft_ending, &
                          install_file
  use text_file, only: is_of_size, take_line
  use file_lock, only: is_locked_by_others, lock_t, hold_folder, release_lock
  use provenance, only: fingerprint_difference
  use hdf5_library, only: hid_t
  use hdf5_file, only: hdf5_file_t, create_file, close_file, take_error, write_reals, write_text, &
                       write_text_attribute
  use existing_result, only: check_replaceable, is_checkpoint_state
  use hdf5_reading, only: open_for_reading, close_reading, read_text_attribute, read_text, &
                          read_numbers
  implicit none
  private

  public :: checkpoint_header_t, write_checkpoint, read_checkpoint
  public :: draft_t, draw_result, place_result, drop_result, remove_leftovers, is_replaceable

  integer, parameter :: digest_length = 16

  !> What a checkpoint belongs to.
  type :: checkpoint_header_t
    character(:), allocatable :: program     !! version and commit
    character(:), allocatable :: build       !! lines of `fingerprint`
    logical :: is_any_build = .false.        !! that of the file may be another
    character(:), allocatable :: deck        !! a line for each keyword: its digest, the first step
                                             !! whose states it changes, its name and its location
    character(:), allocatable :: user        !! digest of the user's subroutines; empty: none
    character(:), allocatable :: deck_file   !! for messages
  end type checkpoint_header_t

  !> A line of `deck`.
  type :: deck_line_t
    character(digest_length) :: digest = ""
    integer :: from = 1                      ! the first step whose states it changes
    character(:), allocatable :: name
  end type deck_line_t

  !> A result that is taken from a checkpoint and not under its name yet.
  type :: draft_t
    character(:), allocatable :: path                   !! where it is now
    character(:), allocatable, private :: result_file, location   ! its name and true path
    type(lock_t), private :: lock
  end type draft_t

  character(*), parameter :: mark = "igaform checkpoint 1 "
  character(*), parameter :: form = "2"      ! of what is in it; files without one are older
  integer, parameter :: last_length = len(mark) + 2*20 + 16 + 1
  integer, parameter :: block_bytes = 1048576

contains

  !> Write a checkpoint that replaces the previous one, which stays if anything fails.
  !! Of several processes the first one writes what all of them hold.
  subroutine write_checkpoint(path, header, store, result_file, error, ranks)
    character(*), intent(in) :: path
    type(checkpoint_header_t), intent(in) :: header
    type(state_store_t), intent(in) :: store
    character(*), intent(in) :: result_file      !! flushed; a path to the open file itself
    type(error_t), allocatable, intent(out) :: error
    class(ranks_t), intent(in), optional :: ranks
    type(ranks_t) :: alone

    if (.not. present(ranks)) then
      call write_whole(path, header, store, result_file, alone, error)
      return
    end if
    if (is_first(ranks)) then
      call write_whole(path, header, store, result_file, ranks, error)
    else
      call hand_over(store, ranks)
    end if
    call share_error(ranks, error)
  end subroutine write_checkpoint

  !> What is held here of the tables goes to the process that writes.
  subroutine hand_over(store, ranks)
    type(state_store_t), intent(in) :: store
    class(ranks_t), intent(in) :: ranks
    real(wp), allocatable :: ignored(:)
    integer :: i

    do i = 1, store%n_entries
      if (allocated(store%entries(i)%columns)) call gather_entry(ranks, store%entries(i), ignored)
    end do
  end subroutine hand_over

  subroutine write_whole(path, header, store, result_file, ranks, error)
    character(*), intent(in) :: path
    type(checkpoint_header_t), intent(in) :: header
    type(state_store_t), intent(in) :: store
    character(*), intent(in) :: result_file
    class(ranks_t), intent(in) :: ranks
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: location, new, reason

    location = true_path(path)
    new = location//draft_ending
    call remove_file(new, reason)
    if (reason /= "") &
      call fail(error, "cannot remove '"//new//"', left by an earlier attempt: "//reason)
    if (allocated(store%reason) .and. .not. allocated(error)) then
      if (store%reason /= "") call fail(error, "internal error, "//store%reason)
    end if
    if (allocated(error)) then
      call hand_over(store, ranks)   ! to nobody: the others wait for it
    else
      call write_state(new, header, store, ranks, error)
    end if
    if (.not. allocated(error)) call append_result(new, result_file, error)
    if (.not. allocated(error)) then
      call install_file(new, location, reason)
      if (reason /= "") call fail(error, reason)
    end if
    if (.not. allocated(error)) return
    call remove_file(new)
    error%message = "checkpoint '"//path//"' not written: "//error%message
  end subroutine write_whole

  subroutine write_state(path, header, store, ranks, error)
    character(*), intent(in) :: path
    type(checkpoint_header_t), intent(in) :: header
    type(state_store_t), intent(in) :: store
    class(ranks_t), intent(in) :: ranks
    type(error_t), allocatable, intent(out) :: error
    type(hdf5_file_t) :: file
    character(:), allocatable :: names
    real(wp), allocatable :: whole(:)
    integer :: i

    call create_file(file, path, is_checked=.true.)
    call write_text_attribute(file, "/", "form", form)
    call write_text_attribute(file, "/", "program", header%program)
    call write_text(file, "/build", header%build, &
                    "what the bits of results depend on besides the deck, one a line")
    call write_text(file, "/deck", header%deck, "keywords of the deck with their digests")
    call write_text_attribute(file, "/", "user", header%user)
    call write_text_attribute(file, "/", "deck_file", header%deck_file)
    names = ""
    do i = 1, store%n_entries
      associate (entry => store%entries(i))
        if (allocated(entry%columns)) then
          call gather_entry(ranks, entry, whole)
          call write_reals(file, "/state/"//entry%name, whole, [size(whole)], "", &
                           "see docs/running.md")
        else
          call write_reals(file, "/state/"//entry%name, entry%values, [size(entry%values)], "", &
                           "see docs/running.md")
        end if
        names = names//entry%name//new_line("a")
      end associate
    end do
    call write_text(file, "/names", names, "names of the numbers under /state, one a line")
    call close_file(file)
    call take_error(file, error)
  end subroutine write_state

  !> The bytes of the result and the last line.
  subroutine append_result(path, result_file, error)
    character(*), intent(in) :: path, result_file
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: n_state, n_result, n_all
    character(last_length) :: last
    character(:), allocatable :: sum
    character(256) :: message
    integer :: unit, status

    inquire (file=path, size=n_state)
    inquire (file=result_file, size=n_result)
    if (n_result < 0) then
      call fail(error, "the result file does not exist any more")
      return
    end if
    call copy_bytes(result_file, 0_int64, n_result, path, error)
    if (allocated(error)) return
    sum = file_checksum(path)
    inquire (file=path, size=n_all)
    if (sum == "" .or. n_all /= n_state + n_result) then
      call fail(error, "it does not read back as it was written")
      return
    end if
    write (last, "(a, 2i20, 2a)") mark, n_state, n_result, sum, new_line("a")
    open (newunit=unit, file=path, access="stream", form="unformatted", action="write", &
          status="old", position="append", iostat=status, iomsg=message)
    if (status == 0) write (unit, iostat=status, iomsg=message) last
    if (status == 0) close (unit, iostat=status, iomsg=message)
    if (status /= 0) then
      call fail(error, trim(message))
    else if (.not. is_of_size(path, n_all + last_length)) then
      call fail(error, "cannot write all of it; is the disk full?")
    end if
  end subroutine append_result

  !> Append bytes of one file to another, which is created if it does not exist.
  subroutine copy_bytes(source, before, n_bytes, target_file, error)
    character(*), intent(in) :: source, target_file
    integer(int64), intent(in) :: before, n_bytes     !! bytes skipped, and copied
    type(error_t), allocatable, intent(out) :: error
    integer(int8), allocatable :: bytes(:)
    integer(int64) :: left, n, n_there
    integer :: from, to, status
    character(256) :: message

    inquire (file=target_file, size=n_there)
    open (newunit=from, file=source, access="stream", form="unformatted", action="read", &
          status="old", iostat=status, iomsg=message)
    if (status == 0) then
      open (newunit=to, file=target_file, access="stream", form="unformatted", action="write", &
            position="append", iostat=status, iomsg=message)
      if (status /= 0) close (from)
    end if
    if (status == 0) then
      allocate (bytes(block_bytes))
      left = n_bytes
      if (before > 0) read (from, pos=before, iostat=status, iomsg=message) bytes(1)
      do while (left > 0 .and. status == 0)
        n = min(left, int(block_bytes, int64))
        read (from, iostat=status, iomsg=message) bytes(:n)
        if (status == 0) write (to, iostat=status, iomsg=message) bytes(:n)
        left = left - n
      end do
      close (from)
      if (status == 0) then
        close (to, iostat=status, iomsg=message)
      else
        close (to)
      end if
    end if
    if (status /= 0) then
      call fail(error, trim(message))
    else if (.not. is_of_size(target_file, max(n_there, 0_int64) + n_bytes)) then
      call fail(error, "cannot write all of it; is the disk full?")
    end if
  end subroutine copy_bytes

  !> Read a checkpoint. Rejected: a file that is none, one that is damaged or of another form, one
  !! of another build of the program, unless the header allows it, or of a deck that differs in what
  !! has been simulated.
  subroutine read_checkpoint(path, header, store, error, other_build, changes)
    character(*), intent(in) :: path
    type(checkpoint_header_t), intent(in) :: header    !! what it must belong to
    type(state_store_t), intent(out) :: store
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable, intent(out), optional :: other_build   !! how it differs; or empty
    type(string_t), allocatable, intent(out), optional :: changes(:)  !! of steps to come, in words
    integer(int64) :: n_bytes(2)
    integer(hid_t) :: file
    type(deck_line_t), allocatable :: was(:), now(:)
    character(:), allocatable :: build, difference    ! how the file differs, or empty
    integer :: step

    call check_whole(path, n_bytes, error)
    if (allocated(error)) return
    file = open_for_reading(path)
    if (file < 0) then
      call reject(path, "HDF5 cannot open it", error)
      return
    end if
    build = fingerprint_difference(read_text(file, "/build"), header%build)
    if (present(other_build)) other_build = build
    step = deck_step_of(file)
    was = lines_of(read_text(file, "/deck"))
    now = lines_of(header%deck)
    difference = first_difference(was, now, step)
    if (present(changes)) changes = changes_after(was, now, step)
    if (read_text_attribute(file, "/", "form") /= form) then
      call reject(path, "it was written by igaform "//read_text_attribute(file, "/", "program")// &
                  ", whose checkpoints have another form", error)
    else if (build /= "" .and. .not. header%is_any_build) then
      call reject(path, "it was written by another build of igaform ("//build// &
                  "), which rounds differently; --restart-any-build continues all the same", error)
    else if (difference /= "") then
      call reject(path, "it belongs to another deck or to other parameters than '"// &
                  header%deck_file//"' now (it was '"// &
                  read_text_attribute(file, "/", "deck_file")//"'): "//difference// &
                  "; it is of step "//to_text(step)//", and only later steps, the data of its "// &
                  "*DYNAMIC, FRAMES and HISTORY of *OUTPUT, *CHECKPOINT and *HEADING may "// &
                  "differ; a parameter counts wherever the deck has it", error)
    else if (read_text_attribute(file, "/", "user") /= header%user) then
      call reject(path, "it was written with other user subroutines than those of --user now", &
                  error)
    else
      call read_entries(file, path, store, error)
    end if
    call close_reading(file)
  end subroutine read_checkpoint

  !> The step of the deck whose state a checkpoint has; the first where it does not say.
  integer function deck_step_of(file) result(step)
    integer(hid_t), intent(in) :: file
    real(wp), allocatable :: values(:)

    step = 1
    call read_numbers(file, "/state/run/deck_step", values)
    if (.not. allocated(values)) return
    if (size(values) == 1) step = nint(max(1.0_wp, min(values(1), 1.0e9_wp)))
  end function deck_step_of

  !> The lines of a deck as in `checkpoint_header_t`.
  pure function lines_of(text) result(lines)
    character(*), intent(in) :: text
    type(deck_line_t), allocatable :: lines(:)
    character(:), allocatable :: line
    integer :: i, n, place, end_of_number, status

    n = count([(text(i:i) == new_line("a"), i=1, len(text))])
    if (len(text) > 0) then
      if (text(len(text):) /= new_line("a")) n = n + 1
    end if
    allocate (lines(n))
    place = 1
    do i = 1, n
      call take_line(text, place, line)
      lines(i)%digest = line
      lines(i)%name = ""
      if (len(line) < digest_length + 2) cycle
      line = line(digest_length + 2:)
      end_of_number = index(line//" ", " ")
      read (line(:end_of_number - 1), "(i10)", iostat=status) lines(i)%from
      if (status /= 0) lines(i)%from = 1   ! damage
      lines(i)%name = line(end_of_number + 1:)
    end do
  end function lines_of

  !> Where two decks differ first in what the states of a step depend on, in words; empty if they
  !! do not.
  pure function first_difference(was, now, step) result(words)
    type(deck_line_t), intent(in) :: was(:), now(:)
    integer, intent(in) :: step
    character(:), allocatable :: words
    integer, allocatable :: old(:), new(:)
    integer :: i

    words = ""
    old = pack([(i, i=1, size(was))], was%from <= step)
    new = pack([(i, i=1, size(now))], now%from <= step)
    do i = 1, max(size(old), size(new))
      if (i > size(new)) then
        words = was(old(i))%name//" does not exist now"
      else if (i > size(old)) then
        words = now(new(i))%name//" is new or not what it was"
      else if (was(old(i))%digest /= now(new(i))%digest) then
        words = now(new(i))%name//" is new or not what it was"
      else
        cycle
      end if
      return
    end do
  end function first_difference

  !> What later steps have, or depend on, that they had not, and what they had and have not now.
  pure function changes_after(was, now, step) result(changes)
    type(deck_line_t), intent(in) :: was(:), now(:)
    integer, intent(in) :: step
    type(string_t), allocatable :: changes(:)

    allocate (changes(0))
    call tell(now, was, "now")
    call tell(was, now, "before")

  contains

    !> Lines of which there are fewer in the others; a keyword may have two, one after the other.
    pure subroutine tell(these, others, when)
      type(deck_line_t), intent(in) :: these(:), others(:)
      character(*), intent(in) :: when
      character(:), allocatable :: last
      integer :: i

      last = ""
      do i = 1, size(these)
        if (these(i)%from <= step .or. these(i)%name == last) cycle
        if (n_like(these(i), these(:i)) <= n_like(these(i), others)) cycle
        last = these(i)%name
        call append_text(changes, "deck after step "//to_text(step)//", "//when//": "//last)
      end do
    end subroutine tell
  end function changes_after

  !> How many of these lines say the same as one, of the same step.
  pure integer function n_like(line, lines)
    type(deck_line_t), intent(in) :: line, lines(:)

    n_like = count(lines%digest == line%digest .and. lines%from == line%from)
  end function n_like

  subroutine read_entries(file, path, store, error)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: path
    type(state_store_t), intent(inout) :: store
    type(error_t), allocatable, intent(inout) :: error
    character(:), allocatable :: names, name
    real(wp), allocatable :: values(:)
    integer :: place

    names = read_text(file, "/names")
    place = 1
    do while (place <= len(names))
      call take_line(names, place, name)
      call read_numbers(file, "/state/"//name, values)
      if (.not. allocated(values)) then
        call reject(path, name//" cannot be read", error)
        return
      end if
      call add_entry(store, name, size(values), values)
    end do
  end subroutine read_entries

  !> Take the result as it was at the checkpoint out of it, under another name; `place_result` puts
  !! it in its place, `drop_result` deletes it. Up to then nobody else creates a file in the folder.
  subroutine draw_result(path, result_file, draft, error)
    character(*), intent(in) :: path, result_file
    type(draft_t), intent(out) :: draft
    type(error_t), allocatable, intent(out) :: error
    integer(int64) :: n_bytes(2)

    draft%result_file = result_file
    draft%location = true_path(result_file)
    draft%path = draft%location//draft_ending
    call check_whole(path, n_bytes, error)
    if (allocated(error)) return
    call hold_folder(result_file, draft%lock)
    call check_replaceable(result_file, "", error)
    if (is_locked_by_others(draft%path)) call fail(error, "result file '"//result_file// &
      "': another program is about to write it; choose another name")
    if (allocated(error)) then
      call release_lock(draft%lock)
      return
    end if
    call remove_file(draft%path)
    call copy_bytes(path, n_bytes(1), n_bytes(2), draft%path, error)
    if (allocated(error)) call give_up_draft(draft, error)
  end subroutine draw_result

  !> Put it in its place.
  subroutine place_result(draft, error)
    type(draft_t), intent(inout) :: draft
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: why

    call install_file(draft%path, draft%location, why)
    if (why /= "") then
      call fail(error, why)
      call give_up_draft(draft, error)
    else
      call release_lock(draft%lock)
    end if
  end subroutine place_result

  subroutine give_up_draft(draft, error)
    type(draft_t), intent(inout) :: draft
    type(error_t), allocatable, intent(inout) :: error

    call drop_result(draft)
    error%message = "result file '"//draft%result_file//"' cannot be taken from the "// &
                    "checkpoint: "//error%message
  end subroutine give_up_draft

  !> Remove it; what is in its place stays.
  subroutine drop_result(draft)
    type(draft_t), intent(inout) :: draft

    call remove_file(draft%path)
    call release_lock(draft%lock)
  end subroutine drop_result

  !> Remove what a killed run may have begun to write next to its result. Only for who has the
  !! result open: nobody else writes these files then.
  subroutine remove_leftovers(result_file, path)
    character(*), intent(in) :: result_file, path    !! path of the checkpoint

    call remove_file(true_path(result_file)//draft_ending)
    call remove_file(true_path(path)//draft_ending)
  end subroutine remove_leftovers

  !> May a checkpoint be written under this name: is there nothing, nothing in it, or a checkpoint,
  !! be it cut or damaged?
  logical function is_replaceable(path)
    character(*), intent(in) :: path
    character(last_length) :: line
    character(:), allocatable :: why
    integer(int64) :: n_bytes
    integer(int8) :: format

    is_replaceable = .not. is_no_file(path)
    if (.not. is_replaceable) return
    call read_ends(path, n_bytes, format, line, why)
    if (why /= "" .or. n_bytes == 0 .or. line(:len(mark)) == mark) return
    is_replaceable = is_checkpoint_state(path)
  end function is_replaceable

  !> What a checkpoint is known by: its length, the version of its HDF5 format, its last line.
  subroutine read_ends(path, n_bytes, format, line, why)
    character(*), intent(in) :: path
    integer(int64), intent(out) :: n_bytes
    integer(int8), intent(out) :: format
    character(last_length), intent(out) :: line         !! spaces where the file is too short
    character(:), allocatable, intent(out) :: why       !! why it cannot be read; else empty
    integer, parameter :: position_of_format = 9        ! in an HDF5 file
    character(256) :: message
    integer :: unit, status

    why = ""
    line = ""
    format = 0
    n_bytes = 0
    open (newunit=unit, file=path, access="stream", form="unformatted", action="read", &
          status="old", iostat=status, iomsg=message)
    if (status /= 0) then
      why = trim(message)
      return
    end if
    inquire (unit=unit, size=n_bytes)
    if (n_bytes > last_length) then
      read (unit, pos=n_bytes - last_length + 1, iostat=status) line
      read (unit, pos=position_of_format, iostat=status) format
    end if
    close (unit)
  end subroutine read_ends

  !> Is this a checkpoint, as it was written to the last byte?
  subroutine check_whole(path, n_parts, error)
    character(*), intent(in) :: path
    integer(int64), intent(out) :: n_parts(2)     !! bytes of state and result
    type(error_t), allocatable, intent(out) :: error
    integer(int8), parameter :: format_110 = 3
    character(last_length) :: line
    character(:), allocatable :: why
    integer(int64) :: n_bytes
    integer(int8) :: format
    integer :: status

    if (is_no_file(path)) then
      call reject(path, "it is a "//kind_of_file(path)//", expected a file", error)
      return
    end if
    call read_ends(path, n_bytes, format, line, why)
    if (why /= "") then
      call reject(path, why, error)
      return
    end if
    if (line(:len(mark)) /= mark) then
      call reject(path, "it is no checkpoint of igaform, or its end is missing", error)
      return
    end if
    read (line(len(mark) + 1:), "(2i20)", iostat=status) n_parts
    if (status /= 0) n_parts = -1
    if (any(n_parts < 0 .or. n_parts > n_bytes) .or. sum(n_parts) + last_length /= n_bytes) then
      call reject(path, "its length is not what its last line says", error)
    else if (file_checksum(path, n_bytes - last_length) /= line(len(mark) + 41:len(mark) + 56)) then
      call reject(path, "it is damaged: its checksum is wrong", error)
    else if (format /= format_110) then
      ! HDF5 may crash on other formats with damage under the right checksum.
      call reject(path, "its HDF5 part is not in the format of igaform's checkpoints", error)
    end if
  end subroutine check_whole

  subroutine reject(path, reason, error)
    character(*), intent(in) :: path, reason
    type(error_t), allocatable, intent(inout) :: error

    call fail(error, "checkpoint '"//path//"' rejected: "//reason)
  end subroutine reject

end module checkpoint
