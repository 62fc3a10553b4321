!> The digest SHA-256 of texts (NIST, FIPS 180-4, 2015): nobody can make another text that has it.
module sha256
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none
  private

  public :: sha256_t, add_to_digest, sha256_text

  integer, parameter :: block_bytes = 64
  integer(int64), parameter :: low = 4294967295_int64   ! the 32 bits that words have

  !> The fractional parts of the cube roots of the first 64 primes.
  integer(int64), parameter :: constants(64) = [ &
    int(z"428a2f98", int64), int(z"71374491", int64), int(z"b5c0fbcf", int64), &
    int(z"e9b5dba5", int64), int(z"3956c25b", int64), int(z"59f111f1", int64), &
    int(z"923f82a4", int64), int(z"ab1c5ed5", int64), int(z"d807aa98", int64), &
    int(z"12835b01", int64), int(z"243185be", int64), int(z"550c7dc3", int64), &
    int(z"72be5d74", int64), int(z"80deb1fe", int64), int(z"9bdc06a7", int64), &
    int(z"c19bf174", int64), int(z"e49b69c1", int64), int(z"efbe4786", int64), &
    int(z"0fc19dc6", int64), int(z"240ca1cc", int64), int(z"2de92c6f", int64), &
    int(z"4a7484aa", int64), int(z"5cb0a9dc", int64), int(z"76f988da", int64), &
    int(z"983e5152", int64), int(z"a831c66d", int64), int(z"b00327c8", int64), &
    int(z"bf597fc7", int64), int(z"c6e00bf3", int64), int(z"d5a79147", int64), &
    int(z"06ca6351", int64), int(z"14292967", int64), int(z"27b70a85", int64), &
    int(z"2e1b2138", int64), int(z"4d2c6dfc", int64), int(z"53380d13", int64), &
    int(z"650a7354", int64), int(z"766a0abb", int64), int(z"81c2c92e", int64), &
    int(z"92722c85", int64), int(z"a2bfe8a1", int64), int(z"a81a664b", int64), &
    int(z"c24b8b70", int64), int(z"c76c51a3", int64), int(z"d192e819", int64), &
    int(z"d6990624", int64), int(z"f40e3585", int64), int(z"106aa070", int64), &
    int(z"19a4c116", int64), int(z"1e376c08", int64), int(z"2748774c", int64), &
    int(z"34b0bcb5", int64), int(z"391c0cb3", int64), int(z"4ed8aa4a", int64), &
    int(z"5b9cca4f", int64), int(z"682e6ff3", int64), int(z"748f82ee", int64), &
    int(z"78a5636f", int64), int(z"84c87814", int64), int(z"8cc70208", int64), &
    int(z"90befffa", int64), int(z"a4506ceb", int64), int(z"bef9a3f7", int64), &
    int(z"c67178f2", int64)]

  !> A digest under way: words, and the bytes that do not fill a block yet.
  type :: sha256_t
    private
    integer(int64) :: words(8) = [ &
      int(z"6a09e667", int64), int(z"bb67ae85", int64), int(z"3c6ef372", int64), &
      int(z"a54ff53a", int64), int(z"510e527f", int64), int(z"9b05688c", int64), &
      int(z"1f83d9ab", int64), int(z"5be0cd19", int64)]
    character(block_bytes) :: rest = ""
    integer :: n_rest = 0
    integer(int64) :: n_bytes = 0
  end type sha256_t

contains

  !> Take a text in.
  pure subroutine add_to_digest(digest, text)
    type(sha256_t), intent(inout) :: digest
    character(*), intent(in) :: text
    integer :: first, n

    digest%n_bytes = digest%n_bytes + len(text)
    first = 1
    do while (first <= len(text))
      n = min(block_bytes - digest%n_rest, len(text) - first + 1)
      digest%rest(digest%n_rest + 1:digest%n_rest + n) = text(first:first + n - 1)
      digest%n_rest = digest%n_rest + n
      first = first + n
      if (digest%n_rest < block_bytes) return
      call add_block(digest%words, digest%rest)
      digest%n_rest = 0
    end do
  end subroutine add_to_digest

  !> The digest of all that was taken in, 64 hexadecimal digits.
  function sha256_text(digest) result(text)
    type(sha256_t), intent(in) :: digest
    character(64) :: text
    type(sha256_t) :: last
    character(8) :: length
    integer :: i

    last = digest
    do i = 1, 8
      length(i:i) = char(ibits(8_int64*digest%n_bytes, 64 - 8*i, 8))
    end do
    call add_to_digest(last, char(128)//repeat(achar(0), modulo(55 - last%n_rest, block_bytes)))
    call add_to_digest(last, length)
    write (text, "(8z8.8)") last%words
  end function sha256_text

  !> Mix a block into the words.
  pure subroutine add_block(words, block)
    integer(int64), intent(inout) :: words(8)
    character(block_bytes), intent(in) :: block
    integer(int64) :: w(64), v(8), first, second
    integer :: i, k

    do i = 1, 16
      w(i) = 0
      do k = 4*i - 3, 4*i
        w(i) = 256*w(i) + ichar(block(k:k))
      end do
    end do
    do i = 17, 64
      first = ieor(ieor(turned(w(i - 15), 7), turned(w(i - 15), 18)), shiftr(w(i - 15), 3))
      second = ieor(ieor(turned(w(i - 2), 17), turned(w(i - 2), 19)), shiftr(w(i - 2), 10))
      w(i) = iand(w(i - 16) + first + w(i - 7) + second, low)
    end do
    v = words
    do i = 1, 64
      first = ieor(ieor(turned(v(5), 6), turned(v(5), 11)), turned(v(5), 25))
      first = first + v(8) + constants(i) + w(i) + &
              ieor(iand(v(5), v(6)), iand(iand(not(v(5)), low), v(7)))
      second = ieor(ieor(turned(v(1), 2), turned(v(1), 13)), turned(v(1), 22))
      second = second + ieor(ieor(iand(v(1), v(2)), iand(v(1), v(3))), iand(v(2), v(3)))
      v(2:8) = v(1:7)
      v(5) = iand(v(5) + first, low)
      v(1) = iand(first + second, low)
    end do
    words = iand(words + v, low)
  end subroutine add_block

  !> The 32 bits turned to the right by n places.
  pure integer(int64) function turned(word, n)
    integer(int64), intent(in) :: word
    integer, intent(in) :: n

    turned = iand(ior(shiftr(word, n), shiftl(word, 32 - n)), low)
  end function turned

end module sha256
