!> The key of a deck for checkpoints: it changes with everything that may not change when a run is
!! taken up again.
module deck_digest
  use sha256, only: sha256_t, add_to_digest, sha256_text
  use text, only: to_text
  use line_list, only: line_text
  use lexer, only: lexed_deck_t
  implicit none
  private

  public :: digest_of_deck, digest_line

  character(*), parameter :: free(6) = [character(10) :: "OUTPUT", "CHECKPOINT", "HEADING", &
                                        "INCLUDE", "PARAMETER", "END"]

  integer, parameter :: n_digits = 16      !! of a digest: they show changes, not intent

contains

  !> Digests of all keywords with their options and data, parameters replaced, but for *OUTPUT,
  !! *CHECKPOINT, *HEADING and the data of the last *DYNAMIC: a line for each, with its name and
  !! place. Comments and the files that the lines come from do not count.
  function digest_of_deck(lexed) result(text)
    type(lexed_deck_t), intent(in) :: lexed
    character(:), allocatable :: text
    character(:), allocatable :: line, room     ! doubled when it is full: decks may be long
    integer :: i, last_dynamic, used

    allocate (character(4096) :: room)
    used = 0
    last_dynamic = 0
    do i = 1, lexed%n_blocks
      if (lexed%blocks(i)%keyword == "DYNAMIC") last_dynamic = i
    end do
    do i = 1, lexed%n_blocks
      if (any(free == lexed%blocks(i)%keyword)) cycle
      line = digest_of_block(lexed, i, i /= last_dynamic)
      do while (used + len(line) > len(room))
        room = room//room
      end do
      room(used + 1:used + len(line)) = line
      used = used + len(line)
    end do
    text = room(:used)
  end function digest_of_deck

  !> The line of one keyword.
  function digest_of_block(lexed, i, has_data) result(line)
    type(lexed_deck_t), intent(in) :: lexed
    integer, intent(in) :: i               !! the block
    logical, intent(in) :: has_data        !! its data lines count
    character(:), allocatable :: line
    type(sha256_t) :: digest
    character(64) :: digits
    integer :: j

    associate (block => lexed%blocks(i))
      call add_to_digest(digest, "*"//block%keyword)
      do j = 1, size(block%options)
        if (block%options(j)%name == "INPUT") cycle
        call add_to_digest(digest, ","//block%options(j)%name)
        if (block%options(j)%has_value) call add_to_digest(digest, "="//block%options(j)%value)
      end do
      do j = block%first, merge(block%last, 0, has_data)
        call add_to_digest(digest, new_line("a")//line_text(lexed%lines, j))
      end do
      digits = sha256_text(digest)
      line = digest_line(digits(:n_digits), "*"//block%keyword//" ("// &
                         lexed%files(block%file)%value//":"//to_text(block%line)//")")
    end associate
  end function digest_of_block

  !> A line of such a digest.
  pure function digest_line(digest, name) result(line)
    character(*), intent(in) :: digest     !! sixteen digits
    character(*), intent(in) :: name       !! what it is of, for messages
    character(:), allocatable :: line

    line = digest//" "//name//new_line("a")
  end function digest_line

end module deck_digest
