!> The key of a deck for checkpoints: it changes with everything that may not change when a run is
!! taken up again.
module deck_digest
  use source_digest, only: digest_t, add_text, digest_text
  use line_list, only: line_text
  use lexer, only: lexed_deck_t
  implicit none
  private

  public :: digest_of_deck

  character(*), parameter :: free(6) = [character(10) :: "OUTPUT", "CHECKPOINT", "HEADING", &
                                        "INCLUDE", "PARAMETER", "END"]

contains

  !> Digest of all keywords with their options and data, parameters replaced, but for *OUTPUT,
  !! *CHECKPOINT, *HEADING and the data of the last *DYNAMIC. Comments and the files that the lines
  !! come from do not count.
  function digest_of_deck(lexed) result(text)
    type(lexed_deck_t), intent(in) :: lexed
    character(16) :: text
    type(digest_t) :: digest
    integer :: i, j, last_dynamic

    last_dynamic = 0
    do i = 1, lexed%n_blocks
      if (lexed%blocks(i)%keyword == "DYNAMIC") last_dynamic = i
    end do
    do i = 1, lexed%n_blocks
      associate (block => lexed%blocks(i))
        if (any(free == block%keyword)) cycle
        call add_text(digest, "*"//block%keyword)
        do j = 1, size(block%options)
          if (block%options(j)%name == "INPUT") cycle
          call add_text(digest, ","//block%options(j)%name)
          if (block%options(j)%has_value) call add_text(digest, "="//block%options(j)%value)
        end do
        if (i == last_dynamic) cycle
        do j = block%first, block%last
          call add_text(digest, new_line("a")//line_text(lexed%lines, j))
        end do
      end associate
    end do
    text = digest_text(digest)
  end function digest_of_deck

end module deck_digest
